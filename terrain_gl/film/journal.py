"""The journal of a flight: a file beside the flight's pictures or parts. With it, the flight can be continued.

The first line of the file is the flight's identity, and each further line belongs to one picture. A picture is complete
if its file exists, because a file gets its name only when it is complete. The journal of a folder stays there: the same
command may be given again.
"""

import json
import os
from pathlib import Path
from typing import Any

from ..basics.exceptions import TerrainError
from ..basics.replacing import replacing
from . import parts
from .parts import JOURNAL
from .record import is_folder, picture_name


class FlightJournal:
    """The journal of a flight.

    Parameters
    ----------
    output
        A folder of pictures, or a film in parts; it may be missing. If it holds another flight, it is refused.
    identity
        A value that JSON can hold; it is equal for flights with equal pictures.
    beside
        The ending of a second file of each picture in a folder, without which the picture is not complete.
    """

    def __init__(self, output: str | os.PathLike[str], identity: object, beside: str | None = None) -> None:
        self._output = None if is_folder(output) else output
        folder = Path(output) if is_folder(output) else parts.folder_of(output)
        self._path = folder / JOURNAL
        self._identity = json.dumps(identity, default=str, sort_keys=True)
        self.done: dict[int, Any] = {}  # the entry of each complete picture, by its number; no gaps in a film
        if not (self._path.is_file() and any(folder.glob("part-*" if self._output else "frame-*"))):
            return
        begun, *lines = self._path.read_text("utf-8", errors="replace").split("\n")
        if begun != self._identity:
            name = "film, or remove it" if self._output else "folder, or empty it"
            raise TerrainError(f"{folder}: holds frames of another flight: name another {name}")
        for line in lines[:-1]:  # text after the last end of line is an incomplete entry
            number, noted = json.loads(line)
            if all(file.is_file() for file in self._files(number, beside)):
                self.done[number] = noted
            elif self._output:
                break

    def begin(self) -> None:
        """Write the file anew, with the pictures that are complete."""
        lines = [self._identity, *map(json.dumps, self.done.items())]
        with replacing(self._path) as part:  # if the process is killed here, the old file is still whole
            part.write_text("".join(line + "\n" for line in lines), "utf-8")

    def add(self, number: int, noted: object) -> None:
        """Add the entry of a picture, before the picture is written."""
        with open(self._path, "a", encoding="utf-8") as file:
            file.write(json.dumps((number, noted)) + "\n")

    def _files(self, number: int, beside: str | None) -> list[Path]:
        """The files with a picture."""
        if self._output:
            return [parts.part_of(self._output, number)]
        picture = self._path.with_name(picture_name(number))
        return [picture, picture.with_suffix(f".{beside}")] if beside else [picture]
