"""Saves what is seen: pictures of any size, the mesh, films, a command line, and bookmarks as a camera path."""

from __future__ import annotations

import shlex
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..exceptions import TerrainError
from ..files.export import FORMATS, Mesh, make_mesh, write_mesh
from ..files.records import json_text
from ..film.path import CameraPath, Keyframe
from ..image import replacing, write_png
from ..steps import Steps
from .filming import Filming, film_suffix
from .frame_budget import FrameBudget
from .painter import Painter
from .scene import FrameSpec, Scene
from .window_state import Size

SIZES: dict[str, Size | None] = {
    "as the window": None,
    "1920 × 1080": (1920, 1080),
    "3840 × 2160": (3840, 2160),
    "7680 × 4320": (7680, 4320),
    "4096 × 4096": (4096, 4096),
}
MESSAGE_S = 15.0


@dataclass
class Shot:
    """A picture that is being drawn for a file; `share` of it is done, 0 to 1."""

    path: Path
    steps: Steps[None]
    share: float = 0.0


class Saver:
    """Writes files to the working directory, beside earlier ones.

    Attributes
    ----------
    size
        Of saved pictures: a key of `SIZES`.
    mesh_format
        Ending of saved meshes.
    shot
        The picture that is being drawn; None if there is none.
    filming
        Records films.
    line_of
        Returns the command line of a view, from heightmap, camera, size and options; None where there is no command.
    on_copy
        Copies a text to the clipboard.
    """

    def __init__(self, scene: Scene, painter: Painter, budget: FrameBudget) -> None:
        self._scene, self._painter, self._budget, self._window = scene, painter, budget, scene.window
        self.size = next(iter(SIZES))
        self.mesh_format = next(iter(FORMATS))
        self.shot: Shot | None = None
        self.filming = Filming(self._window.say)
        self.line_of: Callable[..., str] | None = None
        self.on_copy: Callable[[str], None] = lambda text: None
        self._writing: threading.Thread | None = None

    @property
    def busy(self) -> bool:
        """Whether the next frame should come at once."""
        return self.shot is not None or self.filming.running

    def step(self) -> bool:
        """Draw the picture that is to be saved for a while; returns whether this frame has no time for another."""
        shot = self.shot
        if not shot:
            return False
        if self._painter.light.is_due(self._scene.frame_spec().lit_look):
            if shot.share > 0:
                self.cancel("the picture was not saved: the light has changed")
            return False
        self._window.refresh()
        if self._budget.run(shot.steps, self._tell):
            self.shot = None
            self._painter.forget()
        return True

    def cancel(self, message: str = "cancelled") -> None:
        """Stop drawing the picture, and say why."""
        if self.shot:
            self.shot.steps.close()
            self.shot = None
            self._painter.forget()
            self._window.say(message)

    def map_changed(self) -> None:
        """Stop drawing the picture: it would show two different maps."""
        self.cancel("the picture was not saved: the map has changed")

    def release(self) -> None:
        """Stop drawing, and finish all files that are being written."""
        self.cancel()
        self.filming.stop()
        self.filming.join()
        self.join()

    def join(self) -> None:
        """Wait until the last file is written."""
        if self._writing:
            self._writing.join()

    # --- Pictures -----------------------------------------------------------------------------------------------------

    def save_picture(self) -> None:
        """Save what is seen, without panels."""
        if not self._may_save():
            return
        path = free_path(self._scene.heightmap.name)
        self.shot = Shot(path, self._picture_steps(path, self._scene.frame_spec(SIZES[self.size])))

    def _may_save(self) -> bool:
        """Whether a file can be saved now; if not, say why. Waits for the file before, which takes a free name."""
        if self.shot:
            self._window.say(f"{self.shot.path} is still being drawn: Esc cancels it")
            return False
        if self._scene.is_preview:
            self._window.say("this is a preview: save when the tables are built")
            return False
        self.join()
        return True

    def _tell(self, share: float) -> None:
        assert self.shot
        self.shot.share = share

    def _picture_steps(self, path: Path, spec: FrameSpec) -> Steps[None]:
        """Draw all sides in full size, then write them in a thread; yields progress from 0 to 1."""
        self._painter.interrupt()
        picture = np.zeros((spec.size[1], spec.size[0], 4), np.uint8)
        stats = []
        for side, options in enumerate(spec.sides):
            steps = self._scene.renderer.render_steps(spec.camera, size=spec.size, **vars(options))
            while True:
                try:
                    share = next(steps)
                except StopIteration as end:
                    frame = end.value
                    break
                yield (side + share) / len(spec.sides)
            first, last = (round(edge * spec.size[0]) for edge in spec.part(side))
            picture[:, first:last] = frame.image[:, first:last]
            stats.append(frame.stats)
        self._in_thread(self._write_picture, path, picture, stats)

    def _in_thread(self, write: Callable[..., None], path: Path, *what: Any) -> None:
        """Write a file after the one before."""
        self.join()
        self._writing = threading.Thread(target=write, args=(path, *what), name=f"writing {path}")
        self._writing.start()

    def _write_picture(self, path: Path, picture: np.ndarray, stats: list[dict[str, Any]]) -> None:
        """Write the picture, and the stats of its sides beside it."""
        try:
            numbers = path.with_suffix(".json")
            with replacing(numbers) as part:
                part.write_text(json_text(stats if len(stats) > 1 else stats[0]), "utf-8")
                write_png(path, picture)
        except (TerrainError, OSError) as error:
            self._window.say(str(error))
        else:
            size = f"{picture.shape[1]} × {picture.shape[0]}"
            self._window.say(f"saved {path.absolute()}, {size}; its numbers: {numbers.name}")

    # --- The mesh -----------------------------------------------------------------------------------------------------

    def save_mesh(self) -> None:
        """Save the triangles that the window shows in full size."""
        if not self._may_save():
            return
        renderer = self._scene.renderer
        path = free_path(self._scene.heightmap.name, self.mesh_format)
        self._painter.choose_levels(renderer, self._scene.frame_spec(), 0)
        triangles, heights = renderer.triangles(), renderer.inspector.drawn_heights()
        if len(triangles):
            heightmap = renderer.heightmap
            mesh = make_mesh(triangles, heights, heightmap.spacing_m, place=heightmap.place)
            self._in_thread(self._write_mesh, path, mesh)
        else:
            self._window.say("no triangles in this view: turn the camera")

    def _write_mesh(self, path: Path, mesh: Mesh) -> None:
        try:
            write_mesh(path, mesh)
        except (TerrainError, OSError) as error:
            self._window.say(str(error))
        else:
            unit = "mm" if path.suffix == ".stl" else "metres"
            self._window.say(f"saved {path.absolute()}: {len(mesh.faces):,} triangles in {unit}")

    # --- Films, command lines, camera paths ---------------------------------------------------------------------------

    def toggle_recording(self) -> None:
        """Record what is seen, without panels, or stop."""
        if self.filming.running:
            self.filming.stop()
        else:
            path = free_path(self._scene.heightmap.name, film_suffix())
            self.filming.begin(path, self._window.now_s)

    def copy_line(self) -> None:
        """Copy the command line that draws this view."""
        if not self.line_of:
            return
        spec, settings = self._scene.frame_spec(SIZES[self.size]), self._scene.settings
        options = replace(settings.options, contour_m=spec.sides[settings.active].contour_m)
        try:
            line = self.line_of(self._scene.heightmap, spec.camera, spec.size, options)
        except TerrainError as error:
            self._window.say(str(error))
        else:
            self.on_copy(line)
            self._window.say(f"copied: {line}", MESSAGE_S)

    def save_path(self) -> None:
        """Save the bookmarks, in the order of their numbers, as a path that `terrain-gl fly` follows."""
        poses = [pose for _, pose in sorted(self._scene.controller.bookmarks.items())]
        if len(poses) < 2:
            self._window.say("a path needs two bookmarks or more: Ctrl 1 … 9 set them")
            return
        path = free_path(self._scene.heightmap.name, "-path.json")
        try:
            CameraPath([Keyframe(pose.camera) for pose in poses]).save(str(path))
        except (TerrainError, OSError) as error:
            self._window.say(str(error))
        else:
            name = shlex.quote(self._scene.opened.key or "MAP")
            film = f"terrain-gl fly {name} --path {path} -o flight{film_suffix()}"
            self._window.say(f"saved {path.absolute()}; to make a film of it: {film}", MESSAGE_S)


def free_path(map_name: str, suffix: str = ".png") -> Path:
    """The first of name-001.png, name-002.png, ... that does not exist."""
    stem = Path(map_name).stem or "terrain"
    number = 1
    while (path := Path(f"{stem}-{number:03d}{suffix}")).exists():
        number += 1
    return path
