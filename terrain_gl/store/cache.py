"""Stores of large rasters that are made when a raster is first drawn, in the user's cache folder.

    $XDG_CACHE_HOME/terrain-gl/stores/KEY/map.zarr      by default under ~/.cache (XDG Base Directory Specification 0.8)
                                      KEY/source.json   path of the raster; the file's time is that of the last use
                                      limit.json        the most bytes that all stores may take

All processes that use a store have a lock on its folder KEY. KEY is a hash of the names, sizes and times of the
raster's files, of the options for reading it, and of the program's version. If the stores take more than the limit, the
least recently used stores are removed, except stores in use.
"""

import contextlib
import hashlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ..basics.exceptions import TerrainError
from ..basics.locks import lock, locked
from ..basics.replacing import replacing
from ..basics.version import __version__
from ..readers import Reading, state_of
from ..readers.raster import Spacing
from .build import build
from .format import VERSION, zarr_library
from .opened import StoredMap

# A raster with fewer posts is drawn sooner if no store is made first (docs/stores.md), and all its tables fit storage
# blocks of 128 MiB, which is all that drivers of some cards have.
PAYS_POSTS = 3700 * 3700
MOST_BYTES = 10 << 30
_STORE = "map.zarr"
_SOURCE = "source.json"
_LIMIT = "limit.json"
_in_use: list[int] = []  # locks that this process holds until it ends


class CachedStore(NamedTuple):
    """A store in the cache."""

    key: str
    source: str
    bytes: int
    used_s: float
    is_finished: bool


def folder() -> Path:
    """The folder of all stores; it may not exist yet."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(base) / "terrain-gl" / "stores"


def key_of(path: str, reading: Reading, spacing_m: float | Spacing | None) -> str:
    """The key of a raster that is read with these options."""
    told = [VERSION, __version__, state_of(path), repr((reading, spacing_m))]
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:16]


def is_possible() -> bool:
    """Whether stores can be made on this machine."""
    with contextlib.suppress(TerrainError):
        return bool(zarr_library())
    return False


def has(path: str, reading: Reading, spacing_m: float | Spacing | None) -> bool:
    """Whether the store of a raster is finished."""
    return _is_finished(folder() / key_of(path, reading, spacing_m))


def stored(
    path: str,
    reading: Reading,
    spacing_m: float | Spacing | None = None,
    progress: Callable[[float], None] | None = None,
) -> StoredMap:
    """The store of a raster, which is built at its first use. While this process lives, no process removes the store.

    `TerrainError`: the raster cannot be read, zarr is missing, or the disk is full.
    """
    zarr_library()
    place = folder() / key_of(path, reading, spacing_m)
    held = lock(place, is_shared=True)
    while not _is_finished(place):
        os.close(held)
        with locked(place):  # waits for a process that builds the same store
            if not _is_finished(place):
                _write(place / _SOURCE, {"source": os.path.abspath(path)})
                build(path, place / _STORE, spacing_m, reading, progress=progress)
        held = lock(place, is_shared=True)
    try:
        os.utime(place / _SOURCE)
        opened = StoredMap(place / _STORE)
    except BaseException:
        os.close(held)
        raise
    _in_use.append(held)
    shrink()
    opened.name = path
    return opened


def entries() -> list[CachedStore]:
    """All stores, the most recently used first."""
    found = []
    for place in folder().glob("*/"):
        source = place / _SOURCE
        with contextlib.suppress(OSError, ValueError):
            about = json.loads(source.read_text("utf-8"))
            used_s = source.stat().st_mtime
            found.append(CachedStore(place.name, about["source"], _bytes_of(place), used_s, _is_finished(place)))
    return sorted(found, key=lambda entry: -entry.used_s)


def remove(entry: CachedStore) -> bool:
    """Remove a store; False if another process uses it."""
    place = folder() / entry.key
    try:
        with locked(place, waits=False) as is_alone:
            if is_alone:
                shutil.rmtree(place, ignore_errors=True)
            return is_alone
    except TerrainError:  # no permission
        return False


def shrink() -> None:
    """Remove stores until the others take at most `limit()`."""
    most = limit()
    kept = entries()
    total = sum(entry.bytes for entry in kept)
    while total > most and kept:
        oldest = kept.pop()
        total -= oldest.bytes if remove(oldest) else 0


def limit() -> int:
    """The most bytes that all stores may take."""
    try:
        return int(json.loads((folder() / _LIMIT).read_text("utf-8"))["bytes"])
    except (OSError, ValueError, KeyError, TypeError):
        return MOST_BYTES


def set_limit(most_bytes: int) -> None:
    """Set the limit, and remove stores beyond it."""
    _make(folder())
    _write(folder() / _LIMIT, {"bytes": most_bytes})
    shrink()


def _is_finished(place: Path) -> bool:
    return (place / _STORE / "zarr.json").is_file() and not (place / _STORE / ".build").is_dir()


def _make(place: Path) -> None:
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TerrainError(f"{place}: cannot be made: {error.strerror or error}") from None


def _write(path: Path, value: dict[str, Any]) -> None:
    with replacing(os.fspath(path)) as part, open(part, "w", encoding="utf-8") as file:
        json.dump(value, file)


def _bytes_of(place: Path) -> int:
    total = 0
    for file in place.rglob("*"):
        with contextlib.suppress(OSError):
            total += file.stat().st_size
    return total
