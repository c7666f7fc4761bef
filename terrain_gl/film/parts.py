"""The parts of a film that is not complete: films of a few seconds, in a folder beside the film.

An interrupted flight keeps the complete parts, and only the other frames are drawn again. At the end, the parts are
joined as they are: nothing is encoded twice.
"""

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError

FRAMES = 60  # frames of a part: an interrupted flight loses few; the key frames that begin parts take little space
JOURNAL = ".flight"  # a file beside the pictures or parts of an unfinished flight (terrain_gl/film/journal.py)
Write = Callable[[np.ndarray], None]


def folder_of(film: str | os.PathLike[str]) -> Path:
    """The folder for the parts of a film."""
    return Path(f"{os.fspath(film)}.parts")


def part_of(film: str | os.PathLike[str], frame: int) -> Path:
    """The file of the part that contains a frame; `frame` counts from 0."""
    return folder_of(film) / f"part-{frame // FRAMES + 1:05d}.mp4"


@contextmanager
def writing(
    film: Path,
    first: int,
    lock: int,
    encode: Callable[[Path], AbstractContextManager[Write]],
    join: Callable[[Sequence[Path]], None],
) -> Iterator[Write]:
    """Write the parts of a film from frame `first` on. At the end, join all parts, and remove them.

    Parameters
    ----------
    lock
        The descriptor that locks the folder.
    encode
        Writes one part.
    join
        Writes the film.
    """
    done = complete = first
    try:
        with contextlib.ExitStack() as part:
            put: Write

            def write(image: np.ndarray) -> None:
                nonlocal done, complete, put
                if done % FRAMES == 0:
                    put = part.enter_context(encode(part_of(film, done)))
                put(image)
                done += 1
                if done % FRAMES == 0:
                    part.close()
                    complete = done

            yield write
            part.close()
            complete = done
        join([part_of(film, frame) for frame in range(0, done, FRAMES)])
        for file in folder_of(film).glob("*part-*.mp4"):
            file.unlink()
    except TerrainError as error:
        if not complete:
            raise
        raise TerrainError(f"{error}; the first {complete} pictures are complete") from None
    finally:
        remove_empty(folder_of(film))
        os.close(lock)


def kept(frames: int) -> int:
    """Of the first `frames` frames, the number that are in complete parts."""
    return frames - frames % FRAMES


def join(av: Any, files: Sequence[Path], to: Path, rate: Fraction, options: dict[str, str]) -> None:
    """Join the parts of a film to one file."""
    with av.open(os.fspath(to), "w", format="mp4", container_options=options) as joined:
        stream = None
        for number, file in enumerate(files):
            with av.open(os.fspath(file)) as part:
                stream = stream or joined.add_stream_from_template(part.streams.video[0])
                for packet in part.demux(video=0):
                    if packet.dts is not None:  # the last packet is empty
                        ticks = round(number * FRAMES / rate / packet.time_base)
                        packet.pts = packet.pts + ticks
                        packet.dts = packet.dts + ticks
                        packet.stream = stream
                        joined.mux(packet)


def remove_empty(folder: Path) -> None:
    """Remove a folder without parts, and its journal."""
    with contextlib.suppress(OSError):
        if not any(folder.glob("part-*")):
            (folder / JOURNAL).unlink(missing_ok=True)
            folder.rmdir()
