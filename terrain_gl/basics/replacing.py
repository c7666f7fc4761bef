"""Write a file so that it appears under its name only when it is complete."""

import atexit
import contextlib
import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from . import resources
from .exceptions import TerrainError

_BESIDE: set[Path] = set()  # files that are being written


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary file name beside `path`. If the block ends without an error, that file replaces `path`.

    Raises
    ------
    TerrainError
        `path` is a folder or comes with terrain-gl, its folder is missing, or writing fails.
    """
    path = Path(path)
    check_name(path)
    if path.is_dir():
        raise TerrainError(f"{path} is a folder: name a file in it")
    if not path.parent.is_dir():
        raise TerrainError(f"{path}: there is no folder {path.parent}: make it first")
    if resources.holds(path):
        raise TerrainError(f"{path}: comes with terrain-gl: name another file")
    beside = path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")
    _BESIDE.add(beside)
    try:
        yield beside
        os.replace(beside, path)
    except OSError as error:
        raise TerrainError(f"{path}: cannot write: {error.strerror or error}") from None
    finally:
        _remove(beside)


def _remove(beside: Path) -> None:
    with contextlib.suppress(OSError):
        beside.unlink()
    _BESIDE.discard(beside)


@atexit.register
def _remove_all() -> None:
    """Remove unfinished files, also those whose removal was interrupted by a signal."""
    for beside in tuple(_BESIDE):
        _remove(beside)


def check_name(path: str | os.PathLike[str]) -> None:
    """Refuse a name that is not UTF-8: the libraries that write pictures accept only UTF-8."""
    try:
        os.fspath(path).encode("utf-8")
    except UnicodeEncodeError:
        shown = os.fsencode(path).decode("utf-8", "replace")
        raise TerrainError(f"{shown}: its name is not valid UTF-8: choose another") from None


def make_sure_of_space(to: Path, pixel_bytes: int) -> None:
    """Check for space by writing as many bytes. On a full disk libpng reports nothing, and libjpeg ends the process."""
    left = pixel_bytes + pixel_bytes // 8 + 65536
    if left > shutil.disk_usage(to.parent).free:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with open(to, "wb") as probe:
        while left > 0:
            left -= probe.write(bytes(min(left, 1 << 24)))
