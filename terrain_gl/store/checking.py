"""Compare all files of a finished store with the hashes that were stored when it was built."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.rect import Area
from .format import Arrays, MissingTileError, fields_of, pyramid_of, read_about, shape_of
from .job import WORK, Shard
from .pyramid import StoreSizes, area, areas
from .tiles import Checks, checksums


class Damage(NamedTuple):
    """A file of a store that differs from what was built."""

    file: str  # its path in the store
    reason: str


class Findings(NamedTuple):
    """Results of a check."""

    about: dict[str, Any] | None  # the store's description; None if it is damaged
    checks: Checks | None  # the checksums of all tiles; None if they are damaged
    damage: list[Damage]
    whole: frozenset[Shard]  # the shards whose tiles all have their checksums


def check(path: str | os.PathLike[str], progress: Callable[[float], None] | None = None) -> Findings:
    """Read all files of a store, and compare them with their hashes. `progress` gets the part that is read."""
    folder = Path(path)
    if (folder / WORK).is_dir():
        return Findings(None, None, [Damage(WORK, "the build has not ended: run the same command again")], frozenset())
    try:
        about = read_about(path)
    except TerrainError as error:
        reason = str(error).removeprefix(f"{os.fspath(path)}: ")
        return Findings(None, None, [Damage("zarr.json", reason)], frozenset())
    pyramid = pyramid_of(about)
    arrays = Arrays(path, pyramid)
    is_marked = bool(about["voids"]) or bool(about["has_water"])
    shards = [
        Shard(name, level, *at)
        for level in range(pyramid.top + 1)
        for name in fields_of(level, is_marked)
        for at in areas(shape_of(pyramid, name, level), pyramid.shard_of(name, level))
    ]
    files = {"zarr.json", "checks/c/0", *(file_of(shard) for shard in shards)}
    files |= {f"{name}/zarr.json" for name in about["arrays_sha256"]}
    damage = _strays(folder, files)
    for name, expected in about["arrays_sha256"].items():
        try:
            reason = "" if arrays.metadata_sha256(name) == expected else "is not the file that was built"
        except OSError as error:
            reason = error.strerror or str(error)
        damage += [Damage(f"{name}/zarr.json", reason)] if reason else []
    try:
        checks = Checks(pyramid, is_marked, arrays.read_checks())
    except (TerrainError, ValueError):
        checks = None
    if checks is None or checks.sha256 != about["checks_sha256"]:
        return Findings(about, None, [*damage, Damage("checks/c/0", "the list of checksums is damaged")], frozenset())
    harmed = {each.file for each in damage}
    whole = set()
    for number, shard in enumerate(shards, 1):
        if f"{shard.name}/{shard.level}/zarr.json" not in harmed:
            if found := _damaged_tiles(arrays, checks, shard):
                damage.append(Damage(file_of(shard), found))
            else:
                whole.add(shard)
        if progress:
            progress(number / len(shards))
    return Findings(about, checks, damage, frozenset(whole))


def file_of(shard: Shard) -> str:
    """Path of a shard's file in its store."""
    words = "0/" if shard.name == "ranges" else ""
    return f"{shard.name}/{shard.level}/c/{words}{shard.row}/{shard.col}"


def noted_of(checks: Checks, pyramid: StoreSizes, shard: Shard) -> list[Any]:
    """The checksums of a shard's tiles, as a task returns them."""
    where = _area(pyramid, shard)
    rows, cols = (slice(s.start // pyramid.tile, -(-s.stop // pyramid.tile)) for s in where)
    noted = checks.of[shard.name, shard.level][:, rows, cols]
    return [shard.name, shard.level, where[0].start, where[1].start, noted.tolist()]


def _area(pyramid: StoreSizes, shard: Shard) -> Area:
    shape = shape_of(pyramid, shard.name, shard.level)
    return area(shape, pyramid.shard_of(shard.name, shard.level), (shard.row, shard.col))


def _strays(folder: Path, files: set[str]) -> list[Damage]:
    """Files that no build writes."""
    found = sorted(str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_symlink() or file.is_file())
    return [Damage(name, "is not a file of the store") for name in found if name not in files]


def _damaged_tiles(arrays: Arrays, checks: Checks, shard: Shard) -> str:
    """Which tiles of a shard are missing or damaged; "" if none is."""
    pyramid = arrays.pyramid
    where = _area(pyramid, shard)
    rows, cols = where
    noted = np.array(noted_of(checks, pyramid, shard)[-1], np.uint32)
    try:
        differ = checksums(arrays.read(shard.name, shard.level, where), pyramid.tile) != noted
    except MissingTileError:
        differ = np.zeros(noted.shape, bool)
        for row, col in np.ndindex(noted.shape[1:]):
            top, left = rows.start + row * pyramid.tile, cols.start + col * pyramid.tile
            tile = slice(top, min(top + pyramid.tile, rows.stop)), slice(left, min(left + pyramid.tile, cols.stop))
            try:
                found = checksums(arrays.read(shard.name, shard.level, tile), pyramid.tile)
                differ[:, row, col] = found[:, 0, 0] != noted[:, row, col]
            except MissingTileError:
                differ[:, row, col] = True
    bad = differ.any(0)
    if not bad.any():
        return ""
    if not (arrays.path / file_of(shard)).is_file():
        return "is missing"
    row, col = (int(k[0]) * pyramid.tile for k in np.nonzero(bad))
    first = f"the first from row {rows.start + row}, column {cols.start + col}"
    return f"{np.count_nonzero(bad)} of {bad.size} tiles are damaged, {first}"
