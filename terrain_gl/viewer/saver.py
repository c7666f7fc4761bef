"""Saves pictures of any size, meshes, films, a command line, and bookmarks as a camera path."""

import shlex
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.replacing import replacing
from ..basics.steps import Steps, portion
from ..camera.pieces import Piece
from ..files.export import FORMATS, Mesh, land_mesh, write_mesh
from ..files.furniture import name_stamps, stamp
from ..files.records import json_text
from ..film.path import CameraPath, Keyframe
from ..film.path import FlightFrame as PathPose
from ..film.record import FPS, Recorder
from ..image import write_png
from ..renderer.frame import Stats
from ..renderer.names import Label
from ..shade.picture import Look
from .filming import Filming, film_suffix
from .frame_budget import FrameBudget
from .loops import day, turn
from .painter import Painter, labels_of
from .pose import Pose
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
_Drawn = TypeVar("_Drawn")


@dataclass
class Shot:
    """A picture or a film that is being drawn for a file; `share` is its progress, 0 to 1."""

    path: Path
    steps: Steps[None]
    share: float = 0.0
    is_film: bool = False
    begun_s: float | None = None  # when its first steps were done
    now_s: float = 0.0

    @property
    def words(self) -> str:
        if not self.is_film:
            return f"drawing {self.path}"
        words = f"drawing the film {self.path}: {self.share:.0%}"
        if not self.share or self.begun_s is None:
            return words
        left_s = round((self.now_s - self.begun_s) * (1 / self.share - 1))
        return f"{words}, {left_s // 60}:{left_s % 60:02d} left; it waits while the camera moves"


class Saver:
    """Writes files to the working directory, beside earlier ones."""

    def __init__(self, scene: Scene, painter: Painter, budget: FrameBudget) -> None:
        self._scene = scene
        self._painter = painter
        self._budget = budget
        self._window = scene.window
        self.size = next(iter(SIZES))  # of saved pictures
        self.mesh_format = next(iter(FORMATS))  # ending of the names of saved meshes
        self.shot: Shot | None = None  # the picture or film that is being drawn
        self.filming = Filming()
        self.line_of: Callable[..., str] | None = None  # the command line of a heightmap, camera, size and options
        self.on_copy: Callable[[str], None] = lambda text: None  # copies a text to the clipboard
        self._writing: threading.Thread | None = None
        self._lit: Look | None = None  # the look for which the film last made light
        self._picture: Steps[Any] | None = None  # of the film, that is being drawn
        self._warned: Shot | None = None  # the film about whose loss the user was warned

    def step(self) -> bool:
        """Draw the picture to be saved for a while; returns whether no time is left for the window's own picture."""
        self._note_view()
        shot = self.shot
        if not shot:
            return False
        spec = self._scene.frame_spec()
        if shot.is_film:
            if self._scene.controller.moving or not self._painter.is_done(spec):
                self.disturb()
                return False  # the window's own picture comes first, and stays while the film is drawn
        elif self._painter.light.is_due(spec.lit_look):
            if shot.share > 0:
                self.cancel("the picture was not saved: the light has changed")
            return False
        shot.now_s = self._window.now_s
        shot.begun_s = shot.now_s if shot.begun_s is None else shot.begun_s
        self._window.refresh()
        try:
            done = self._budget.run(shot.steps, self._tell)
        except (TerrainError, OSError) as error:
            self.cancel(str(error))
            return True
        if done:
            self.shot = None
            self._painter.forget()
        return True

    @property
    def is_drawing(self) -> bool:
        """Whether the renderer holds a picture for a file, and not that of the window."""
        return self.shot is not None and (self._picture is not None or not self.shot.is_film)

    def disturb(self) -> None:
        """Let the window use the renderer; the film goes on later, with the same picture from its start."""
        if self._picture:
            self._picture.close()
            self._picture = None
            if self._lit != self._scene.frame_spec().lit_look:
                self._painter.light.stop()  # so that the window makes its own light again

    def cancel(self, message: str = "cancelled") -> None:
        """Stop drawing the picture, and say why."""
        if self.shot:
            self.shot.steps.close()
            self.shot = None
            self._painter.forget()
            self._window.say(message)

    def map_changed(self, is_new: bool = False) -> None:
        """Stop drawing the picture: it would show two different maps. Another map ends a recording, too."""
        if is_new and self.filming.running:
            self.filming.stop()
            self._window.say("the recording has ended without a film: the map has changed")
        self.cancel("the picture was not saved: the map has changed")

    def join(self) -> None:
        if self._writing:
            self._writing.join()

    # --- Pictures -----------------------------------------------------------------------------------------------------

    def save_picture(self) -> None:
        """Save the visible picture, without panels."""
        if not self._may_save():
            return
        path = free_path(self._scene.heightmap.name)
        self.shot = Shot(path, self._picture_steps(path, self._scene.frame_spec(SIZES[self.size])))

    def _may_save(self) -> bool:
        """Whether a file can be saved now; if not, a message says why. First waits for the last file to be written."""
        if self.shot:
            self._window.say(f"{self.shot.path} is still being drawn: Esc cancels it")
            return False
        if self._scene.is_preview:
            offer = self._scene.opened.offer
            self._window.say(offer or "this is a preview: save when the tables are built")
            return False
        self.join()
        return True

    def _tell(self, share: float) -> None:
        assert self.shot
        self.shot.share = share

    def _picture_steps(self, path: Path, spec: FrameSpec) -> Steps[None]:
        """Draw all sides in full size, then write them in a thread; yields progress from 0 to 1."""
        picture, stats = yield from self._drawn_steps(spec)
        self._in_thread(self._write_picture, path, picture, stats)

    def _drawn_steps(self, spec: FrameSpec) -> Steps[tuple[np.ndarray, list[Stats]]]:
        """Draw all sides in full size; returns the picture, (height, width, 4), and the stats of each side."""
        self._painter.interrupt()
        renderer = self._scene.renderer
        picture = np.zeros((spec.size[1], spec.size[0], 4), np.uint8)
        stats: list[Stats] = []
        seen: list[Label] = []  # by the first side, as in the window

        def receive(piece: Piece, pixels: np.ndarray) -> None:
            part = spec.split.parts(spec.size[0])[len(stats)]
            start, stop = (edge + part.shift for edge in (piece.cols.start, piece.cols.stop))
            first, last = max(part.first, start), min(part.last, stop)
            if first < last:
                picture[piece.rows, first:last] = pixels[:, first - start : last - start]
            if not stats:
                seen.extend(labels_of(renderer, spec))

        for side, options in enumerate(spec.sides):
            with self._for_a_file():
                steps = renderer.draw_steps(spec.camera, size=spec.size, receive=receive, **vars(options))
                stats.append((yield from portion(steps, side, len(spec.sides))))
        with suppress(TerrainError):  # there is no font
            stamp(picture, 0, name_stamps(spec.size, spec.split.moved(seen, spec.size[0])))
        return picture, stats

    @contextmanager
    def _for_a_file(self) -> Iterator[None]:
        """A picture for a file waits for the tiles of a store, and has the bar of the style "error"."""
        streaming, picture = self._scene.renderer.streaming, self._scene.renderer.picture
        picture.has_bar = True
        if streaming:
            streaming.waits = True
        try:
            yield
        finally:
            picture.has_bar = False
            if streaming:
                streaming.waits = False

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Show an error in the window, and go on after the block."""
        try:
            yield
        except (TerrainError, OSError) as error:
            self._window.say(str(error))

    def _in_thread(self, write: Callable[..., None], path: Path, *what: object) -> None:
        """Write a file in the thread, after all earlier files."""
        self.join()
        self._writing = threading.Thread(target=write, args=(path, *what), name=f"writing {path}")
        self._writing.start()

    def _write_picture(self, path: Path, picture: np.ndarray, stats: list[Stats]) -> None:
        """Write the picture, and the stats of its sides beside it."""
        numbers = path.with_suffix(".json")
        with self._told():
            with replacing(numbers) as part:
                part.write_text(json_text(stats if len(stats) > 1 else stats[0]), "utf-8")
                write_png(path, picture)
            size = f"{picture.shape[1]} × {picture.shape[0]}"
            self._window.say(f"saved {path.absolute()}, {size}; its numbers: {numbers.name}")

    def _undisturbed(self, draw: Callable[[], Steps[_Drawn]]) -> Steps[_Drawn]:
        """Draw a picture of a film; after a disturbance, draw it once more from its start."""
        while True:
            self._picture = steps = draw()
            try:
                while self._picture is steps:
                    try:
                        share = next(steps)
                    except StopIteration as done:
                        return cast(_Drawn, done.value)
                    yield share
            finally:
                steps.close()

    # --- The mesh -----------------------------------------------------------------------------------------------------

    def save_mesh(self) -> None:
        """Save the triangles that the window shows in full size."""
        if not self._may_save():
            return
        renderer = self._scene.renderer
        spec = self._scene.frame_spec()
        with self._for_a_file():
            shown = self._painter.choose_mesh(renderer, spec, 0)
        triangles = renderer.inspector.triangles(shown)
        if not len(triangles):
            self._window.say("no triangles in this view: turn the camera")
            return
        heights = renderer.inspector.drawn_heights(shown)
        missing = len(shown.stats.get("tiles_missing", ()))
        lacks = f"; not complete: {missing} tiles are missing" if missing else ""
        with self._told():
            drawn = heights * np.float32(spec.sides[0].exaggeration)
            mesh = land_mesh(renderer.heightmap, triangles, drawn, spec.sides[0].voids)
            self._in_thread(self._write_mesh, free_path(renderer.heightmap.name, self.mesh_format), mesh, lacks)

    def _write_mesh(self, path: Path, mesh: Mesh, lacks: str) -> None:
        with self._told():
            write_mesh(path, mesh)
            unit = "mm" if path.suffix == ".stl" else "metres"
            self._window.say(f"saved {path.absolute()}: {len(mesh.faces):,} triangles in {unit}{lacks}")

    # --- Films, command lines, camera paths ---------------------------------------------------------------------------

    def toggle_recording(self) -> None:
        """Record the flight, or stop, and draw it as a film in full quality."""
        if self.filming.running:
            self._note_view()
            self._film(self.filming.stop(), "the recording was too short for a film", self.filming.near_m)
        elif self._may_save():
            self.filming.begin()
            self._window.say("recording the flight: R stops, and the film is drawn")

    def turn(self) -> None:
        """Draw a film that turns once around the land in the middle of the picture."""
        if self._may_save():
            self._film(turn(self._scene), "there is only sky in the middle of the picture: turn the camera")

    def day(self) -> None:
        """Draw a film of the present view from sunrise to sunset."""
        if self._may_save():
            self._film(day(self._scene), "the sun does not rise here on the first of August")

    def _note_view(self) -> None:
        if self.filming.running:
            scene = self._scene
            sun = scene.settings.options.sun
            camera = scene.for_renderer(scene.controller.camera)
            self.filming.note(self._window.now_s, camera, sun, scene.controller.near_m)

    def _film(self, flight: CameraPath | None, reason: str, near_m: float | None = None) -> None:
        """Save a flight as a path, and begin to draw its film; without a flight, say the reason."""
        if flight is None:
            self._window.say(reason)
            return
        name = self._scene.heightmap.name
        spec = self._scene.frame_spec(SIZES[self.size])
        path = free_path(name, film_suffix())
        saved = free_path(name, "-path.json")
        if near_m:
            spec = replace(spec, sides=tuple(replace(side, near_m=near_m) for side in spec.sides))
        with self._told():
            flight.save(str(saved))
            steps = self._film_steps(Recorder(path, FPS), flight, spec)
            next(steps)  # from now on, closing the steps ends the recorder
            self.shot = Shot(path, steps, is_film=True)

    def _film_steps(self, recorder: Recorder, flight: CameraPath, spec: FrameSpec) -> Steps[None]:
        """Draw and record each view of a flight; the film is finished in a thread. Yields progress from 0 to 1."""

        def draw(pose: PathPose) -> Steps[np.ndarray]:
            view = replace(spec, camera=pose.camera)
            if pose.sun:
                view = replace(view, sides=tuple(replace(side, sun=pose.sun) for side in spec.sides))
            self._lit = view.lit_look
            for _ in self._scene.renderer.picture.light_steps(view.lit_look):
                yield 0.0
            picture, _ = yield from self._drawn_steps(view)
            return picture

        count = max(2, round((flight.seconds or 0.0) * FPS))
        try:
            yield 0.0
            for number, pose in enumerate(flight.poses(count)):
                image = yield from portion(self._undisturbed(partial(draw, pose)), number, count)
                while not recorder.append(image, wait=False):  # the encoder is behind
                    yield (number + 1) / count
                yield (number + 1) / count
        except BaseException:
            recorder.cancel()
            raise
        finally:
            self.disturb()
        self._in_thread(self._finish_film, Path(recorder.path), recorder)

    def _finish_film(self, path: Path, recorder: Recorder) -> None:
        """Finish a film; the encoder may take a while."""
        with self._told():
            recorder.close()
            film = "" if path.suffix else ", a folder of pictures (pip install 'terrain-gl[video]' for films)"
            self._window.say(f"saved {path.absolute()}{film}: {recorder.frames} frames", MESSAGE_S)

    def may_leave(self) -> bool:
        """Whether the map may be left: no film is being drawn, or the user was warned before. If not, warn."""
        if self.filming.running:
            self.toggle_recording()
        if not self.shot or not self.shot.is_film or self._warned is self.shot:
            return True
        self._warned = self.shot
        self._window.say(f"{self.shot.path} is still being drawn; repeat to leave without it", MESSAGE_S)
        return False

    def copy_line(self) -> None:
        if not self.line_of:
            return
        scene = self._scene
        spec = scene.frame_spec(SIZES[self.size])
        options = replace(spec.sides[0], chosen_for=None)
        with self._told():
            line = self.line_of(scene.heightmap, spec.camera, spec.size, options, laid=scene.renderer.overlays)
            self.on_copy(line)
            self._window.say(f"copied: {line}", MESSAGE_S)

    def save_path(self) -> None:
        """Save the bookmarks, in the order of their numbers, as a path that `terrain-gl fly` follows."""
        scene = self._scene
        poses = [scene.drawn_pose(Pose.read(state["view"])) for _, state in sorted(scene.bookmarks.items())]
        if len(poses) < 2:
            self._window.say("a path needs two bookmarks or more: Ctrl 1 … 9 set them")
            return
        path = free_path(scene.heightmap.name, "-path.json")
        with self._told():
            CameraPath([Keyframe(scene.for_renderer(pose.camera)) for pose in poses]).save(str(path))
            name = shlex.quote(scene.opened.key or "MAP")
            higher = "" if scene.exaggeration == 1 else f" --exaggeration {scene.exaggeration:.6g}"
            film = f"terrain-gl fly {name} --path {path}{higher} -o flight{film_suffix()}"
            self._window.say(f"saved {path.absolute()}; to make a film of it: {film}", MESSAGE_S)


def free_path(map_name: str, suffix: str = ".png") -> Path:
    """The first of name-001.png, name-002.png, ... that does not exist."""
    stem = Path(map_name).stem or "terrain"
    return next(path for i in count(1) if not (path := Path(f"{stem}-{i:03d}{suffix}")).exists())
