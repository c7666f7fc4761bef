"""What can be taken away: pictures of any size, the mesh, films, the view as a command line, bookmarks as a path."""

from __future__ import annotations

import shlex
import threading
from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..exceptions import TerrainError
from ..export import FORMATS, make_mesh, write_mesh
from ..film.path import CameraPath, Keyframe
from ..image import replacing, write_png
from ..readers import Spacing
from ..records import json_text
from .filming import Filming, film_suffix
from .painter import Size, Wanted

if TYPE_CHECKING:
    from .flight import Flight

SIZES: dict[str, Size | None] = {
    "as the window": None,
    "1920 × 1080": (1920, 1080),
    "3840 × 2160": (3840, 2160),
    "7680 × 4320": (7680, 4320),
    "4096 × 4096": (4096, 4096),
}
TOLD_S = 15.0


@dataclass
class Shot:
    """A picture on its way to a file."""

    path: Path
    work: Generator[float, None, None]
    share: float = 0.0


class Keeping:
    """Pictures, films and words.

    Attributes
    ----------
    size
        Of the pictures that are saved: one of `SIZES`.
    mesh_format
        Ending of the meshes that are saved.
    shot
        The picture that is being drawn.
    filming
        The film that is being recorded.
    line_of
        Gives a view as a command line, from heightmap, camera, size and drawing; None where nobody knows.
    on_copy
        Takes a text to the clipboard.
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self.size = next(iter(SIZES))
        self.mesh_format = next(iter(FORMATS))
        self.shot: Shot | None = None
        self.filming = Filming(flight.say)
        self.line_of: Callable[..., str] | None = None
        self.on_copy: Callable[[str], None] = lambda text: None
        self._writing: threading.Thread | None = None

    @property
    def busy(self) -> bool:
        """Whether the next frame should come at once."""
        return self.shot is not None or self.filming.running

    def step(self) -> bool:
        """Draw on at the picture that is to be saved; whether that leaves no time for another."""
        shot, flight = self.shot, self._flight
        if not shot:
            return False
        if flight.painter.dawn.is_due(flight.wanted().lit_look):
            if shot.share > 0:
                self.cancel("the picture was not saved: the light has changed")
            return False
        flight.refresh()
        if flight.pace.go_on(shot.work, self._tell):
            self.shot = None
            flight.painter.forget()
        return True

    def cancel(self, why: str = "cancelled") -> None:
        """Save no picture."""
        if self.shot:
            self.shot.work.close()
            self.shot = None
            self._flight.painter.forget()
            self._flight.say(why)

    def land_changed(self) -> None:
        """A picture that is half drawn would show two lands."""
        self.cancel("the picture was not saved: the land has changed")

    def release(self) -> None:
        """End what is under way, and wait for it."""
        self.cancel()
        self.filming.stop()
        self.filming.join()
        self.join()

    def join(self) -> None:
        """Wait until the last picture is written."""
        if self._writing:
            self._writing.join()

    # --- Pictures -----------------------------------------------------------------------------------------------------

    def shoot(self) -> None:
        """Save what is seen, without words over it, beside earlier ones in the working directory."""
        if self.shot:
            self._flight.say(f"{self.shot.path} is still being drawn: Esc cancels it")
            return
        self.join()  # what is still being written has its name when it is done
        path = free_name(self._flight.renderer.heightmap.name)
        self.shot = Shot(path, self._shooting(path, self._flight.wanted(SIZES[self.size])))

    def _tell(self, share: float) -> None:
        assert self.shot
        self.shot.share = share

    def _shooting(self, path: Path, wanted: Wanted) -> Generator[float, None, None]:
        """Draw all sides in full, then have them written in a thread."""
        self._flight.painter.interrupt()
        picture = np.zeros((wanted.size[1], wanted.size[0], 4), np.uint8)
        stats = []
        for side, drawing in enumerate(wanted.sides):
            work = self._flight.renderer.rendering_large(wanted.camera, wanted.size, **vars(drawing))
            while True:
                try:
                    share = next(work)
                except StopIteration as end:
                    frame = end.value
                    break
                yield (side + share) / len(wanted.sides)
            first, last = (round(edge * wanted.size[0]) for edge in wanted.part(side))
            picture[:, first:last] = frame.image[:, first:last]
            stats.append(frame.stats)
        self._in_thread(self._write_picture, path, picture, stats)

    def _in_thread(self, write: Callable[..., None], path: Path, *what: Any) -> None:
        """Write a file, after the one before."""
        self.join()
        self._writing = threading.Thread(target=write, args=(path, *what), name=f"writing {path}")
        self._writing.start()

    def _write_picture(self, path: Path, picture: np.ndarray, stats: list[dict[str, Any]]) -> None:
        """The picture, and beside it the numbers of its sides."""
        try:
            numbers = path.with_suffix(".json")
            with replacing(numbers) as part:
                part.write_text(json_text(stats if len(stats) > 1 else stats[0]), "utf-8")
                write_png(path, picture)
        except (TerrainError, OSError) as error:
            self._flight.say(str(error))
        else:
            self._flight.say(
                f"saved {path.absolute()}, {picture.shape[1]} × {picture.shape[0]}; its numbers: {numbers.name}"
            )

    # --- The mesh -----------------------------------------------------------------------------------------------------

    def save_mesh(self) -> None:
        """Save the very triangles that the window shows, or is about to show in full."""
        flight = self._flight
        if self.shot:
            flight.say(f"{self.shot.path} is still being drawn: Esc cancels it")
            return
        self.join()  # as above
        renderer, path = flight.renderer, free_name(flight.renderer.heightmap.name, self.mesh_format)
        flight.painter.ready_for(renderer, flight.wanted(), 0)
        triangles, heights = renderer.triangles(), renderer.drawn_heights()
        if len(triangles):
            self._in_thread(self._write_mesh, path, triangles, heights, renderer.heightmap.spacing_m)
        else:
            flight.say("no triangles in this view: turn the camera")

    def _write_mesh(self, path: Path, triangles: np.ndarray, heights: np.ndarray, spacing_m: Spacing) -> None:
        try:
            write_mesh(path, make_mesh(triangles, heights, spacing_m, weld=True))
        except (TerrainError, OSError) as error:
            self._flight.say(str(error))
        else:
            self._flight.say(f"saved {path.absolute()}: {len(triangles):,} triangles in metres")

    # --- Films and words ----------------------------------------------------------------------------------------------

    def toggle_recording(self) -> None:
        """Record what is seen, without panels, until it is called again."""
        if self.filming.running:
            self.filming.stop()
        else:
            path = free_name(self._flight.renderer.heightmap.name, film_suffix())
            self.filming.begin(path, self._flight.now_s)

    def tell_line(self) -> None:
        """This view as a command line, on the clipboard."""
        if not self.line_of:
            return
        flight = self._flight
        wanted = flight.wanted(SIZES[self.size])
        try:
            line = self.line_of(flight.renderer.heightmap, wanted.camera, wanted.size, flight.settings.drawing)
        except TerrainError as error:
            flight.say(str(error))
        else:
            self.on_copy(line)
            flight.say(f"copied: {line}", TOLD_S)

    def save_path(self) -> None:
        """The bookmarks, in the order of their numbers, as a path that `terrain-gl fly` follows."""
        flight = self._flight
        poses = [pose for _, pose in sorted(flight.controller.bookmarks.items())]
        if len(poses) < 2:
            flight.say("a path leads through two bookmarks or more: Ctrl 1 … 9 set them")
            return
        path = free_name(flight.renderer.heightmap.name, "-path.json")
        try:
            CameraPath([Keyframe(pose.camera) for pose in poses]).save(str(path))
        except (TerrainError, OSError) as error:
            flight.say(str(error))
        else:
            film = (
                f"terrain-gl fly {shlex.quote(flight.land.opened.key or 'MAP')} --path {path} -o flight{film_suffix()}"
            )
            flight.say(f"saved {path.absolute()}: {film} makes a film of it", TOLD_S)


def free_name(map_name: str, suffix: str = ".png") -> Path:
    """First of name-001.png, name-002.png, ... that is not there yet."""
    stem = Path(map_name).stem or "terrain"
    number = 1
    while (path := Path(f"{stem}-{number:03d}{suffix}")).exists():
        number += 1
    return path
