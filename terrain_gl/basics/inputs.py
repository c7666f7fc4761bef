"""Checks of input files. Only regular files are read: opening a pipe may wait for ever, and a device has no end."""

import os
import stat

from .exceptions import TerrainError


def is_store(path: str | os.PathLike[str]) -> bool:
    """Whether a folder has the file `zarr.json`, as each Zarr v3 group has: a store, for example."""
    return os.path.isfile(os.path.join(path, "zarr.json"))


def check_input(path: str | os.PathLike[str], advice: str, most_bytes: int | None = None) -> str:
    """Refuse a path that is not a readable regular file; returns the path as text for messages.

    Parameters
    ----------
    path : str or path
    advice : str
        What to do instead, for the message.
    most_bytes : int, optional
        The largest file that is accepted.

    Raises
    ------
    TerrainError
        No such file, no regular file, or one that is too long.
    """
    name = os.fsencode(path).decode("utf-8", "replace")
    try:
        about = os.stat(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise TerrainError(f"{name}: cannot be read ({reason}): check its name and permissions") from None
    if not stat.S_ISREG(about.st_mode):
        raise TerrainError(f"{name}: is not a file but a directory, pipe or device: {advice}")
    if most_bytes is not None and about.st_size > most_bytes:
        raise TerrainError(f"{name}: is {about.st_size:,} bytes long, more than {most_bytes:,}: {advice}")
    return name
