"""The viewer: the scene and the parts that work on it, frame by frame, in any framebuffer.

It knows neither a window system nor panels (app.py). The time of a frame is an argument, so tests need no clock.
"""

from pathlib import Path
from typing import NamedTuple

import moderngl
import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..gpu.passes import clear
from ..gpu.timing import Stopwatch
from ..light.climate import AUTO
from ..renderer import Renderer
from ..renderer.lines import Lines
from .alarm import Alarm
from .brush_tool import BrushTool
from .explainer import Explainer
from .file_dialog import FileDialog
from .frame_budget import FrameBudget
from .frame_stats import FrameStats
from .image_reader import ImageReader
from .layers import Layers, is_layer
from .lecture import Lecture, Station, read_lecture
from .lecture_store import LectureStore
from .legend import Legend, legend
from .loading import Opened
from .map_loader import MapLoader
from .marks import largest_error, lines_on_land, sums_frame
from .memory import Memory
from .mouse import Mouse
from .painter import REST_S, Painter
from .places import LARGEST, place_of
from .pointer import Pointer
from .pose import Pose
from .recovery import note_error
from .ruler import Ruler
from .saver import Saver
from .scene import Scene
from .sculpting import Sculpting
from .settings import Settings
from .store_tiles import StoreTiles, never_wait
from .tour import Tour
from .window_state import Frame, Size, WindowState

HINT_S = 10.0
QUIT_S = 5.0  # Esc closes the window if it is pressed again within this time
_LONGEST_S = 0.25  # most seconds that the camera moves in one frame, even after a longer frame
_BACKGROUND = (0.16, 0.19, 0.23, 1.0)
_LENS_PX = 110


class Progress(NamedTuple):
    """Long work: its name, the share that is done, and whether Esc cancels it."""

    text: str
    share: float
    can_cancel: bool


class Viewer:
    """Connects the parts. The framebuffer `target`, of this `size`, is what the user sees."""

    def __init__(
        self,
        ctx: moderngl.Context,
        target: moderngl.Framebuffer,
        size: Size,
        settings: Settings,
        memory: Memory | None = None,
        budget: FrameBudget | None = None,
    ) -> None:
        self.ctx = ctx
        self.target = target
        self.settings = settings
        self.memory = memory or Memory(None)
        self.budget = budget or FrameBudget()
        self.window = WindowState(size)
        self.scene = Scene(settings, self.window)
        self.painter = Painter(ctx, self.budget)
        self.pointer = Pointer(self.scene)
        self.tiles = StoreTiles(self.scene, self.painter)
        self.loader = MapLoader(ctx, self.scene, self.budget)
        self.explainer = Explainer(self.scene, self.pointer, self.painter)
        self.saver = Saver(self.scene, self.painter, self.budget)
        self.images = ImageReader(self.scene)
        self.layers = Layers(self.scene, self.painter, self.saver, self.images)
        self.sculpting = Sculpting(self.scene, self.pointer, self.budget, self._edited)
        self.ruler = Ruler()
        self.tour = Tour(self.scene)
        self.alarm = Alarm(None)
        self.files = FileDialog(self.window, self.open)
        self.mouse = Mouse(self.scene, self.pointer, self.sculpting, self.ruler, self._clicked)
        self.lecture: Lecture | None = None  # once one was begun
        self.lecture_store = LectureStore(self.scene, self.loader, self.sculpting, self.budget)
        self.lost: list[Path] = []  # recovery files of windows that ended by an error
        self._lines: Lines | None = None
        self._moved_s: float | None = None
        self._asked_until_s = float("-inf")

    def close(self) -> None:
        """Release resources, end all threads, and remember what the next run needs."""
        self.sculpting.cancel()
        if self.lecture:
            self.lecture.end()
        self.saver.cancel()
        self.saver.join()
        self.files.close()
        self.painter.release()
        self.sculpting.join()
        if self.window.closing:  # the user was asked; if the window ends otherwise, the recovery file stays
            self.sculpting.recovery.remove()
        self.images.join()
        self.layers.join()
        self._remember_map()
        self.loader.cancel()
        if self.scene.has_map:
            self.scene.renderer.release()
        self.lecture_store.remove()
        if self._lines:
            self._lines.release()
        self.memory.note(self.settings, self.explainer.unsplit)
        self.memory.save()

    # --- The map ------------------------------------------------------------------------------------------------------

    def show(self, renderer: Renderer, opened: Opened) -> None:
        """Show a map from now on; the viewer releases its renderer."""
        scene = self.scene
        is_preview = renderer.heightmap is not opened.heightmap or bool(opened.offer or opened.rest)
        replaces_preview = scene.has_map and scene.awaits_map and opened.key == scene.opened.key
        never_wait(renderer)
        self._remember_map()
        self.tour.end()
        self.painter.interrupt()
        self.sculpting.new_map(None if is_preview else BrushTool(renderer))
        self.saver.map_changed(is_new=True)
        before = scene.replace_renderer(renderer, is_preview)
        shown = opened.heightmap
        frame = FrameStats(Path(shown.name).name, (shown.cols, shown.rows), is_preview, is_preview and not opened.offer)
        self.painter.new_map(frame)
        self.layers.new_map(opened, is_preview)
        if before and not self.lecture_store.keeps(before, scene.opened, opened):
            before.release()
            self.lecture_store.remove()
        if not replaces_preview:
            self._enter(opened, is_first=before is None)
        elif opened is not scene.opened:  # a sample was shown, and this is its map
            scene.go_on(opened)
        if not is_preview:
            self._tell(opened)
        renderer.picture.waits_for_light = False
        renderer.picture.has_bar = False
        renderer.timer.queries = Stopwatch.works(self.ctx)
        self.explainer.forget()
        if self.lecture and self.lecture.is_wanted and not is_preview:
            self.lecture.begin()

    def _enter(self, opened: Opened, is_first: bool) -> None:
        self.scene.bookmarks = self.memory.bookmarks(opened.key)
        self.ruler.clear()
        if not is_first or self.settings.options.look == AUTO:  # a look that the user gave applies to the first map
            self.settings.change_all(look=self.memory.look(opened.key) or AUTO)
        if not is_first and opened.key != self.scene.opened.key:
            self.settings.forget_map()
            self.scene.frozen = None
        self.scene.enter(opened, self.memory.last_pose(opened.key))

    def _tell(self, opened: Opened) -> None:
        """Say how the map's file was understood, as the command line does."""
        heightmap = opened.heightmap
        notes = [opened.note, *(note for note in heightmap.notes if "--spacing" not in note)]
        if heightmap.assumes_spacing:
            assumed = f"{heightmap.spacing_m[0]:g} m is assumed: set the spacing under Map"
            notes.append(f"{Path(heightmap.name).name} gives no distance between its posts, {assumed}")
        if any(notes):
            self.window.say("; ".join(filter(None, notes)), HINT_S)

    @property
    def title(self) -> str:
        """Name of the map, with a star while it has unsaved edits."""
        return self.painter.frame.name + "*" * self.sculpting.unsaved

    def _remember_map(self) -> None:
        scene = self.scene
        if scene.has_map:
            look = self.settings.options.look
            pose = scene.true_pose(scene.controller.pose)
            self.memory.note_map(scene.opened.key, pose, scene.bookmarks, look)

    def open(self, name: str) -> None:
        """Load a bundled map or a file, unless edits would be lost; or show a file over the land: `layers.is_layer`."""
        if is_layer(name):
            self.layers.add(name)
        elif self._may_leave():
            self.loader.open(name)

    def go_to(self, typed: str) -> None:
        """Travel to the place that a text names: see `places.place_of`."""
        try:
            worst = self.explainer.worst(0) if typed.strip().lower() == LARGEST else None
            self.travel_above(place_of(self.scene.renderer, typed) if worst is None else worst)
        except UsageError as error:
            self.window.say(str(error))

    def travel_above(self, place: np.ndarray) -> None:
        """Travel to where a place of the land, (3,) in world metres, is seen from above."""
        camera = self.scene.controller.above(place)
        self.scene.controller.travel_to(Pose.of(self.scene.beside_panel(camera)))

    def legend(self, side: int) -> Legend | None:
        """The legend of one side, with the levels of its mesh; None for a preview."""
        scene, options = self.scene, self.settings.sides[side]
        if scene.is_preview:
            return None
        steps = self.painter.steps_log2(scene.renderer, side) if options.style == "lod" else ()
        return legend(options, steps, scene.heightmap)

    def give_lecture(self, stations: list[Station] | None = None) -> None:
        """Begin a lecture, by default the one of the package; or go on with it where it was left."""
        if stations or not self.lecture:
            parts = self.scene, self.painter, self.explainer, self.layers, self.sculpting, self.pointer
            self.lecture = Lecture(stations or read_lecture(), *parts)
        if self.scene.has_map and not self.scene.awaits_map:
            self.lecture.begin()

    def exaggerate(self, factor: float) -> None:
        """Draw the relief `factor` times as high as it is."""
        self.scene.exaggerate(factor)
        self.saver.cancel("the picture was not saved: the exaggeration has changed")
        self.painter.forget(at_once=True)
        self.painter.light.stop()

    def hold_in_memory(self) -> None:
        """Load the raster itself into memory, in place of its store, unless edits would be lost."""
        if self._may_leave():
            self.loader.hold_in_memory()

    def rescale(self, **scale: tuple[float, float]) -> None:
        """Show the same posts with another spacing or other heights; the arguments are those of `MapLoader.rescale`."""
        if self._may_leave():
            self.loader.rescale(**scale)

    def _may_leave(self) -> bool:
        """Whether the map may be left without loss; if not, warn. A second call permits it anyway."""
        return self.saver.may_leave() and self.sculpting.may_leave()

    def _edited(self, settled: bool) -> None:
        """Follow a change of the land; `settled`: the stroke is done."""
        self.painter.forget(at_once=True)
        self.saver.map_changed()
        self.explainer.explanation = None
        if settled:
            self.painter.light.stop()

    def _clicked(self, x: float, y: float) -> None:
        shot = self.saver.shot
        if not shot or shot.is_film:  # otherwise the renderer is drawing another picture
            self.saver.disturb()
            self.explainer.explain(x, y)

    def cancel(self) -> bool:
        """Cancel one piece of long work; returns whether there was any."""
        if self.loader.can_cancel:
            self.loader.cancel()
        elif self.saver.shot:
            self.saver.cancel()
        elif self.sculpting.at_work:
            self.sculpting.cancel()
        else:
            return False
        self.window.say("cancelled")
        return True

    def recover(self, error: Exception) -> str:
        """After an error, drop all unfinished work, so that the next frame begins afresh; returns a line about it."""
        self.painter.forget()
        self.painter.light.stop()
        self.mouse.drag = ""
        words = str(error).split("\n")[0] or "no more is known"
        line = f"an error in the program: {type(error).__name__}: {words}"
        if isinstance(error, TerrainError):
            line = words
        elif isinstance(error, OSError) and error.filename and error.strerror:  # of a file, such as a disk that is full
            line = f"{error.filename}: {error.strerror.lower()}"
        if folder := self.sculpting.recovery.folder:
            note_error(error, folder)
        try:
            self.sculpting.cancel()
            kept = self.sculpting.rescue()
        except Exception as another:
            return f"{line}; the sculpted land is in no recovery file: {another}"
        return f"{line}; the sculpted land is in {kept}, too" if kept else line

    def ask_quit(self) -> None:
        """Close the window at the second request within some seconds, so that one Esc too many does not close it."""
        again = self.window.now_s < self._asked_until_s
        self._asked_until_s = self.window.now_s + QUIT_S
        if again:
            self.quit()
        else:
            self.window.say("Esc again closes the window", QUIT_S)

    def quit(self) -> None:
        """Close the window, unless edits would be lost. A second call closes it anyway."""
        self.window.closing = self.window.closing or self._may_leave()

    # --- Frames -------------------------------------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """Whether the next frame should come at once; otherwise the frame comes after an event or `wait_s`."""
        if not self.scene.has_map or self.loader.job or self.window.stale:
            return True
        if self.saver.shot or self.sculpting.at_work or (self.lecture and self.lecture.jumps.at_work):
            return True
        if self.lecture_store.builds:
            return True
        return self.scene.controller.moving or self.painter.is_busy(self.scene.frame_spec())

    @property
    def _is_used(self) -> bool:
        """Whether something is open or at work that the user will come back to."""
        shows = self.lecture is not None and self.lecture.station is not None
        tools = self.sculpting.brushing or self.ruler.taken or self.saver.filming.running
        return shows or tools or self.settings.help or bool(self.files.folder or self.sculpting.save_as is not None)

    @property
    def settled(self) -> bool:
        """Whether the picture is complete: in full size, lit, with all dabs. Its error may not be measured yet."""
        if not self.scene.has_map or self.loader.job or self.tiles.are_coming or self.tiles.is_rebuilding:
            return False
        if self.sculpting.tool and self.sculpting.tool.due:
            return False
        return self.painter.is_done(self.scene.frame_spec()) and not self.tiles.lacks_light

    @property
    def wait_s(self) -> float:
        """Seconds until a frame may be due without any event."""
        if (self.loader.job and not self.loader.job.opened) or self.images.busy or self.layers.busy or self.files.busy:
            return 0.03
        if self.lecture_store.at_work:
            return 0.03
        if self.tiles.are_coming or self.tiles.is_rebuilding:
            return 0.02
        if self.mouse.waits or self.saver.filming.running:
            return 0.05
        waits = self.window.message or (self.scene.has_map and self.painter.waits_for_rest)
        return REST_S / 2 if waits else 1.0

    @property
    def progress(self) -> Progress | None:
        """Long work in progress; None if there is none."""
        drawing = self.painter.share if self.scene.has_map else None
        if drawing is not None and not self.painter.has_picture:
            return Progress(f"drawing the first picture: {drawing:.0%}", drawing, False)
        if job := self.loader.job:
            return Progress(job.text, job.progress, self.loader.can_cancel)
        if self.painter.light.share is not None or self._is_dark:
            return Progress("computing light and shadow", self.painter.light.share or 0.0, False)
        if shot := self.saver.shot:
            return Progress(shot.words, shot.share, True)
        if self.tiles.are_coming:
            return Progress(self.tiles.text, self.tiles.share, False)
        return None if drawing is None else Progress("drawing in full size", drawing, False)

    @property
    def _is_dark(self) -> bool:
        """Whether a map has no light at all yet, although its style needs some."""
        if not self.scene.has_map or self.scene.is_preview or self.tiles.are_coming:
            return False
        lit = self.scene.renderer.picture.lighting.is_there
        return self.scene.frame_spec().lit_look.is_lit and not lit and not self.painter.frame.awaits_map

    @property
    def shown(self) -> tuple[object, ...]:
        """What decides which panels there are, and about how large they are."""
        progress, painter = self.progress, self.painter
        words = progress and progress.text.rstrip("%0123456789")
        return words, self.window.message, painter.has_picture, painter.frame.is_preview, bool(painter.frame.stats)

    def step(self, now_s: float) -> bool:
        """Work for a while, `now_s` seconds after the start; returns whether the window must be drawn again."""
        self.window.now_s = now_s
        awaits_preview = self.scene.has_map and not self.painter.has_picture  # it comes before the tables
        if not awaits_preview and (arrived := self.loader.step()):
            self.show(*arrived)
        if self.lecture and self.scene.has_map:
            self._follow_lecture(self.lecture)
        if not self.window.is_visible:
            return False
        self.window.end_message()
        self.sculpting.step()
        self.images.step()
        self.layers.step()
        if self.scene.has_map:
            self.tour.step(may_begin=not (self.busy or self._is_used))
        self.files.step()
        self.mouse.step(now_s)
        if self.scene.has_map and not self.saver.step():
            self._move()
            self._paint()
            if self.lecture:
                self.lecture.step(self.settled)
        return self.window.stale

    def _follow_lecture(self, lecture: Lecture) -> None:
        """Show a store of the map while a station needs it, and then the map again."""
        station, coming = lecture.station, lecture.coming
        has_time = lecture.shows_all and self.settled
        back = self.lecture_store.step(bool(station and station.store), bool(coming and coming.store), has_time)
        lecture.lacks = self.lecture_store.words
        if back:
            pose, sides = self.scene.controller.pose, list(self.settings.sides)
            self.show(*back)
            if not lecture.station:
                self.scene.controller.pose, self.settings.sides = pose, sides

    def draw(self) -> None:
        """Draw the picture and the marks over it into the target."""
        self.window.stale = False
        if self.scene.has_map and self.painter.has_picture:
            self._draw_scene()
        else:
            clear(self.target, colour=_BACKGROUND)

    def _move(self) -> None:
        controller = self.scene.controller
        now_s = self.window.now_s
        if not controller.moving:
            self._moved_s = None
            return
        since_s = 1 / 60 if self._moved_s is None else now_s - self._moved_s
        controller.step(min(since_s, _LONGEST_S))
        self._moved_s = now_s

    def _paint(self) -> None:
        sculpts = self.sculpting.at_work
        if sculpts:
            self.sculpting.work()
        scene = self.scene
        self.tiles.step()
        waits = self.tiles.are_coming or (scene.is_preview and self.loader.job is not None)
        moving = scene.controller.moving or sculpts or waits
        if self.painter.step(scene.renderer, scene.frame_spec(), self.window.now_s, moving):
            self.window.refresh()
        shown = self.painter
        if shown.drawn:
            self.alarm.watch(scene, shown.drawn, shown.side_stats, shown.side_measured)

    def _draw_scene(self) -> None:
        scene = self.scene
        canvas = self.painter.canvas
        canvas.show(self.target, scene.split, self._lens)
        self.explainer.follow_cursor()
        lines = lines_on_land(scene, self.pointer, self.explainer, self.sculpting, self.ruler)
        around = [largest_error(scene, self.explainer, side) for side in range(scene.split.sides)]
        if self.lecture:
            around = [lines + self.lecture.jumps.bars(side) for side, lines in enumerate(around)]
        if (lines or any(around)) and not self.saver.is_drawing:  # then the depths are those of the file's picture
            self._lines = self._lines or Lines(self.ctx, scene.renderer.picture.samples)
            spec = scene.frame_spec()
            eye = spec.sides[0].seen(scene.heightmap, spec.camera)
            shrunk = 1 / scene.exaggeration, 1 / scene.exaggeration, 1.0  # so the renderer draws the land
            picture, size = scene.renderer.picture, self.window.size
            for own, (first, last, shift) in zip(around, scene.split.parts(size[0]), strict=True):
                part = first, 0, last - first, size[1]
                drawn = [(points * shrunk, colour) for points, colour in (*lines, *own)]
                self._lines.draw(picture, eye, self.target, size, drawn, 2 * self.window.scale, shift, part)
        if (box := self.explainer.box) and not self.settings.help:
            canvas.show_sums(box, self.target, self.sums_frame)

    @property
    def sums_frame(self) -> Frame:
        """The frame in which the summed-area table is shown."""
        box = self.explainer.box
        table = box.table.size if box else (self.scene.heightmap.cols, self.scene.heightmap.rows)
        return sums_frame(table, self.window.size, self.window.scale)

    @property
    def _lens(self) -> tuple[float, float, float, float] | None:
        if not (self.settings.lens and self.pointer.over_land):
            return None
        x, y = self.pointer.over_land
        return x, self.window.size[1] - y, _LENS_PX * self.window.scale, self.settings.lens
