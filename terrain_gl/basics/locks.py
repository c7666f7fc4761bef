"""Locks on folders. A lock leaves no file, and the system releases it when its process ends."""

import contextlib
import fcntl
import os
from collections.abc import Callable, Iterator
from pathlib import Path

from .exceptions import TerrainError


def lock(folder: str | os.PathLike[str], is_shared: bool = False, waits: bool = True) -> int:
    """Lock a folder, which is made if it is missing.

    Parameters
    ----------
    folder
        The folder.
    is_shared
        Others may have a shared lock at the same time.
    waits
        Wait for processes that have a lock of the other kind.

    Returns
    -------
    int
        A descriptor; closing it releases the lock.

    Raises
    ------
    BlockingIOError
        Another process has a lock, and `waits` is false.
    TerrainError
        The folder cannot be made or opened.
    """
    kind = (fcntl.LOCK_SH if is_shared else fcntl.LOCK_EX) | (0 if waits else fcntl.LOCK_NB)
    while True:
        try:
            os.makedirs(folder, exist_ok=True)
            descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        except FileNotFoundError:  # another process has removed the folder
            continue
        except OSError as error:
            raise TerrainError(f"{os.fspath(folder)}: cannot write: {error.strerror or error}") from None
        try:
            fcntl.flock(descriptor, kind)
        except BaseException as error:  # another process has it, or a signal has come while we waited
            if isinstance(error, OSError) and not isinstance(error, BlockingIOError):
                return descriptor  # a file system without locks
            os.close(descriptor)
            raise
        if _is_at(descriptor, folder):
            return descriptor
        os.close(descriptor)  # it was removed while we waited


@contextlib.contextmanager
def locked(
    folder: str | os.PathLike[str], waits: bool = True, tell: Callable[[], None] | None = None
) -> Iterator[bool]:
    """Lock a folder against all others; yields False if another process has a lock, and `waits` is false.

    `tell` is called before a wait. A folder that is empty at the end is removed.
    """
    try:
        descriptor = lock(folder, waits=False)
    except BlockingIOError:
        if not waits:
            yield False
            return
        if tell:
            tell()
        descriptor = lock(folder)
    try:
        yield True
    finally:
        with contextlib.suppress(OSError):
            Path(folder).rmdir()
        os.close(descriptor)


def _is_at(descriptor: int, folder: str | os.PathLike[str]) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(folder))
    except FileNotFoundError:
        return False
