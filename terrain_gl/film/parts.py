"""The parts of a film that is not complete: films of a few seconds, in a folder beside the film.

An interrupted flight keeps the complete parts, and only the other frames are drawn again.
"""

import contextlib
import os
from pathlib import Path

FRAMES = 60  # frames of a part: an interrupted flight loses few; the key frames that begin parts take little space
JOURNAL = ".flight"  # a file beside the pictures or parts of a flight (terrain_gl/film/journal.py)


def folder_of(film: str | os.PathLike[str]) -> Path:
    """The folder for the parts of a film."""
    return Path(f"{os.fspath(film)}.parts")


def part_of(film: str | os.PathLike[str], frame: int) -> Path:
    """The file of the part that contains a frame; `frame` counts from 0."""
    return folder_of(film) / f"part-{frame // FRAMES + 1:05d}.mp4"


def kept(frames: int) -> int:
    """Of the first `frames` frames, the number that are in complete parts."""
    return frames - frames % FRAMES


def remove_empty(folder: Path) -> None:
    """Remove a folder without parts, and its journal."""
    with contextlib.suppress(OSError):
        if not any(folder.glob("part-*")):
            (folder / JOURNAL).unlink(missing_ok=True)
            folder.rmdir()
