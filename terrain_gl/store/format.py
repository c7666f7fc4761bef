"""A store on disk: a Zarr v3 group with one array for each level and field.

    heights/l   float32 metres, every 2^l-th post                                  (rows, cols)
    errors/l    the error of each node as a cell of a patch, levels ≥ 1            (rows, cols)
    ranges/l    lowest and highest height of each node, levels ≥ 1                 (2, rows, cols)
    marks/l     bits of posts and nodes (pages/marks.py); only if the map has any  (rows, cols)

    checks      a checksum of each tile of all these arrays (store/tiles.py)           (n)

Errors are records of glsl/error/nodes.glsl, bit for bit. A tile counts as missing if it was never written, or if
its checksum is wrong.
"""

import hashlib
import json
import os
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.rect import Area
from ..basics.replacing import replacing
from ..basics.version import __version__
from ..readers.georeference import Georeference, Grid
from .pyramid import StoreSizes

INSTALL = "pip install 'terrain-gl[store]'"
VERSION = 9
_KEY = "terrain_gl"
_SEAL = "description_sha256"
_UNSEALED = "0" * 64
_RAW = "https://raw.githubusercontent.com/zarr-conventions/multiscales/refs/tags/v0.1/schema.json"
_CONVENTION = {
    "uuid": "d35379db-88df-4056-af3a-620245f8e347",
    "name": "multiscales",
    "schema_url": _RAW,
    "spec_url": "https://github.com/zarr-conventions/multiscales/blob/v0.1/README.md",
    "description": "Multiscale layout of zarr datasets",
}
FIELDS: dict[str, tuple[str, Any, int]] = {  # type, value of entries that were never written, words of an entry
    "heights": ("float32", np.nan, 1),
    "errors": ("uint32", 0xFFFFFFFF, 1),
    "ranges": ("uint16", 0xFFFF, 2),
    "marks": ("uint8", 0, 1),
}
_OF_POSTS = ("heights", "marks")  # the other fields are of nodes
_TOLD_MISSING = ("heights", "errors")  # in these fields, no valid entry equals the value of entries never written

_FAULTS = (ValueError, OSError, RuntimeError, KeyError)  # what zarr raises for data that it cannot read


def fields_of(level: int, is_marked: bool) -> Iterator[str]:
    """The fields that a level has."""
    yield "heights"
    if is_marked:
        yield "marks"
    if level:
        yield from ("errors", "ranges")


def shape_of(pyramid: StoreSizes, name: str, level: int) -> tuple[int, int]:
    """Rows and columns of an array."""
    return pyramid.posts(level) if name in _OF_POSTS else pyramid.nodes(level)


class MissingTileError(TerrainError):
    """A tile that was never written, is damaged, or cannot be read."""


class Arrays:
    """The arrays of a store in a folder, to read and to write."""

    def __init__(self, path: str | os.PathLike[str], pyramid: StoreSizes) -> None:
        self.path = Path(path)
        self.pyramid = pyramid
        self._open: dict[str, Any] = {}

    def create(self, is_marked: bool = False) -> None:
        """Make the group and its arrays, all empty; arrays that exist already stay as they are."""
        zarr = zarr_library()
        group = zarr.open_group(str(self.path), mode="a", zarr_format=3)
        for level in range(self.pyramid.top + 1):
            for name in fields_of(level, is_marked):
                group.require_group(name)
                if f"{name}/{level}" not in group:
                    self._create(group, name, level)

    def _create(self, group: Any, name: str, level: int) -> None:
        from zarr.codecs import BloscCodec, Crc32cCodec

        dtype, missing, words = FIELDS[name]
        all_words, one_word = ((words,), (1,)) if words > 1 else ((), ())
        tile = self.pyramid.tile
        shard = self.pyramid.shard_of(name, level)
        group.create_array(
            f"{name}/{level}",
            shape=(*all_words, *shape_of(self.pyramid, name, level)),
            dtype=dtype,
            chunks=(*one_word, tile, tile),
            shards=(*all_words, shard, shard),
            compressors=[BloscCodec(cname="zstd", clevel=5, shuffle="bitshuffle"), Crc32cCodec()],
            fill_value=missing,
        )

    def write(self, name: str, level: int, where: Area, values: np.ndarray) -> None:
        """Write whole shards."""
        self._array(name, level)[(Ellipsis, *where)] = values

    def read(self, name: str, level: int, where: Area) -> np.ndarray:
        """Read an area, with all words of each entry.

        Raises
        ------
        MissingTileError
            A tile of the area was never written, is damaged, or cannot be read.
        """
        try:
            values = np.asarray(self._array(name, level)[(Ellipsis, *where)])
        except _FAULTS as error:
            reason = "its checksum does not fit" if "checksum" in str(error) else _short(error)
            raise self.missing(name, level, where, reason) from None
        known = ~np.isnan(values) if name == "heights" else values != FIELDS[name][1]
        if name in _TOLD_MISSING and not known.all():
            raise MissingTileError(f"{self.called(name, level, where)}: was never written")
        return values

    def called(self, name: str, level: int, where: Area) -> str:
        """The name of an area in messages."""
        rows, cols = where
        where_ = f"rows {rows.start} to {rows.stop - 1}, columns {cols.start} to {cols.stop - 1}"
        return f"{self.path}: {name}/{level}, {where_}"

    def missing(self, name: str, level: int, where: Area, reason: str) -> MissingTileError:
        """An error that names an area, the reason, and what to do."""
        return MissingTileError(f"{self.called(name, level, where)}: {reason}: {mending(self.path)}")

    def write_checks(self, values: np.ndarray) -> None:
        """Write the checksums of all tiles."""
        group = zarr_library().open_group(str(self.path), mode="r+", zarr_format=3)
        group.create_array("checks", data=values, chunks=values.shape, overwrite=True)

    def read_checks(self) -> np.ndarray:
        """The checksums of all tiles; a `TerrainError` says why they cannot be read."""
        try:
            return np.asarray(zarr_library().open_array(str(self.path / "checks"), mode="r", zarr_format=3)[:])
        except _FAULTS as error:
            reason = f"its list of checksums cannot be read ({_short(error)}): {mending(self.path)}"
            raise TerrainError(f"{self.path}: {reason}") from None

    def _array(self, name: str, level: int) -> Any:
        key = f"{name}/{level}"
        if key not in self._open:
            self._open[key] = zarr_library().open_array(str(self.path / name / str(level)), mode="r+", zarr_format=3)
        return self._open[key]

    def write_about(self, about: dict[str, Any]) -> None:
        """Write the store's description: the last step of a build."""
        layout = [{"asset": "heights/0", "scale": [1.0, 1.0], "translation": [0.0, 0.0]}]
        for level in range(1, self.pyramid.top + 1):
            place = {"scale": [2.0, 2.0], "translation": [0.0, 0.0]}
            layout.append({"asset": f"heights/{level}", "derived_from": f"heights/{level - 1}", **place})
        group = zarr_library().open_group(str(self.path), mode="r+", zarr_format=3)
        arrays = sorted(str(file.parent.relative_to(self.path)) for file in self.path.glob("*/**/zarr.json"))
        own = {"format": VERSION, "written_by": f"terrain-gl {__version__}", **about}
        own["arrays_sha256"] = {name: self.metadata_sha256(name) for name in arrays}
        group.attrs.put(
            {
                "zarr_conventions": [_CONVENTION],
                "multiscales": {"layout": layout, "resampling_method": "nearest"},
                _KEY: own | {_SEAL: _UNSEALED},
            }
        )
        with replacing(self.path / "zarr.json") as part:
            part.write_bytes(_sealed((self.path / "zarr.json").read_bytes()))

    def metadata_sha256(self, name: str) -> str:
        """Hash of the metadata of an array, such as "heights/0"."""
        return hashlib.sha256((self.path / name / "zarr.json").read_bytes()).hexdigest()


def read_about(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The description of a finished store.

    Raises
    ------
    TerrainError
        The folder holds no store, an unfinished store, or a store of another format.
    """
    name = os.fspath(path)
    try:
        data = Path(path, "zarr.json").read_bytes()
    except OSError:
        raise TerrainError(f"{name}: is not a store: make one with terrain-gl build") from None
    try:
        about = json.loads(data)["attributes"].get(_KEY)
    except (ValueError, KeyError, TypeError, AttributeError):
        raise TerrainError(f"{name}: its zarr.json is damaged, or of no store: {mending(name)}") from None
    if not isinstance(about, dict):
        raise TerrainError(f"{name}: is not a finished store: build it with terrain-gl build MAP -o {name}")
    if about.get("format") != VERSION:
        told = f"is a store of format {about.get('format')}, not {VERSION}"
        raise TerrainError(f"{name}: {told}: make it anew with terrain-gl build MAP -o {name} --mend")
    if _sealed(data.replace(str(about.get(_SEAL)).encode(), _UNSEALED.encode())) != data:
        raise TerrainError(f"{name}: its zarr.json is damaged: {mending(name)}")
    return about


def _sealed(data: bytes) -> bytes:
    """A description with its own hash: the hash of its bytes with zeros in place of the hash."""
    return data.replace(_UNSEALED.encode(), hashlib.sha256(data).hexdigest().encode(), 1)


def mending(path: str | os.PathLike[str]) -> str:
    """What to do with a damaged store."""
    return f"mend it with terrain-gl build MAP -o {os.fspath(path)} --mend"


def _short(error: Exception) -> str:
    return " ".join(str(error).split())[:80]


def pyramid_of(about: dict[str, Any]) -> StoreSizes:
    """The sizes of a store."""
    return StoreSizes(*(int(about[name]) for name in StoreSizes._fields))


def georeference_of(about: dict[str, Any]) -> Georeference | None:
    """Where the map of a store lies."""
    place = about["georeference"]
    size = (int(about["cols"]), int(about["rows"]))
    return Georeference(Grid(*place["transform"]), place["crs"], size) if place else None


def zarr_library() -> Any:
    """The module `zarr`; a `TerrainError` if it is not installed, or older than 3."""
    try:
        import zarr
    except ImportError:
        raise TerrainError(f"stores need zarr: {INSTALL}") from None
    if int(zarr.__version__.split(".")[0]) < 3:
        raise TerrainError(f"stores need zarr 3, this is {zarr.__version__}: {INSTALL}")
    warnings.filterwarnings("ignore", module="zarr")
    return zarr
