"""The frames of a flight, in order, drawn by this process, by several processes, or by workers of a Dask cluster.

Each worker has its own renderer. A frame does not depend on the frames before it. So whichever worker draws it, it has
the same pixels.
"""

import contextlib
import io
import os
import threading
import uuid
from collections.abc import Callable, Collection, Generator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..basics.steps import Steps, drain, portion
from ..basics.version import __version__
from ..files import maps
from ..files.furniture import stamp
from ..film.path import CameraPath, FlightFrame
from ..renderer.facts import Facts
from ..store import is_store
from ..store.scheduling import scheduler
from . import overlays
from .records import DrawOptions, OutputOptions
from .scene import CommandScene, make_renderer, open_scene

OF_FLIGHT = (
    *("method", "metric", "certified_metric", "requested_max_error_px", "width", "height"),
    *("gl_renderer", "backend", "gpu_bytes"),
)
OF_FRAME = (
    *("triangles", "patches", "patches_hidden", "splits", "certified_max_error_px", "complete"),
    *("tiles_missing", "tiles_wide", "overlay_samples", "ms"),
)
MEASURED = (
    *("max_error_px", "rms_error_px", "max_error_posts_px", "posts_measured", "land_measured", "rounding_px"),
    "holes",
)
_of_thread = threading.local()


class Drawn(NamedTuple):
    """A frame."""

    image: np.ndarray
    numbers: dict[str, Any]  # of this frame
    about: dict[str, Any]  # numbers that all frames share
    facts: Facts | None


@dataclass(frozen=True)
class FlyOptions(DrawOptions):
    """What `fly` was told."""

    fps: float
    measure: bool
    workers: int
    keyframes: str | None = None
    seconds: float | None = None
    scheduler: str | None = None

    @property
    def files(self) -> list[str]:
        """The files that are read beside the map."""
        return [*super().files, *([self.keyframes] if self.keyframes else [])]


class FlightJob(NamedTuple):
    """Data that the workers of a flight share; `key` is new for each run."""

    key: str
    asked: FlyOptions


class Drawing:
    """A renderer that draws the frames of a flight, each as if it were the only one."""

    def __init__(self, asked: FlyOptions, scene: CommandScene) -> None:
        self._asked = asked
        self._scene = scene
        self._renderer = make_renderer(scene, asked, lit=True)
        if self._renderer.streaming:
            self._renderer.streaming.is_repeatable = True

    def steps(self, pose: FlightFrame) -> Steps[Drawn]:
        """Draw a frame in steps."""
        asked, scene, renderer = self._asked, self._scene, self._renderer
        is_free = pose.sun is not None and not (asked.light.sun or asked.light.time)  # the path may move the sun
        sun = pose.sun if is_free and pose.sun else scene.frame.sun
        scene = replace(scene, camera=pose.camera, frame=replace(scene.frame, sun=sun))
        frame = yield from renderer.render_steps(gradual=False, **scene.view())
        facts = frame.facts if asked.output.facts else None  # before `measure` draws over the picture
        stats: Mapping[str, Any] = renderer.measure() if asked.measure else frame.stats
        keys = OF_FRAME + (MEASURED if asked.measure else ())
        numbers = scene.pose(asked.camera.size) | {key: stats[key] for key in keys if key in stats}
        image = frame.image[..., :3]
        stamps = scene.stamps(asked.laid, asked.camera.size)
        stamp(image, 0, [*overlays.names(asked.camera.size, renderer.labels(), stamps), *stamps])
        with renderer.session:
            numbers["sees_land"] = renderer.picture.sees_land()
        return Drawn(image, numbers, {key: stats[key] for key in OF_FLIGHT}, facts)

    def close(self) -> None:
        """Release GPU resources."""
        self._renderer.release()


@dataclass(frozen=True)
class Flight:
    """A path that is drawn as `count` frames."""

    asked: FlyOptions
    scene: CommandScene
    path: CameraPath
    count: int

    def frames(
        self, kept: Collection[int], show: Callable[[float], None] | None
    ) -> Generator[tuple[int, Drawn], None, None]:
        """Draw the frames except those `kept`, each with its number; `show` is called with the progress, 0 to 1."""
        asked = self.asked
        numbers = [number for number in range(self.count) if number not in kept]
        poses = (pose for number, pose in enumerate(self.path.poses(self.count)) if number not in kept)
        if not numbers:
            return
        if asked.workers == 1 and not asked.scheduler:
            with contextlib.closing(Drawing(asked, self.scene)) as drawing:
                for done, (number, pose) in enumerate(zip(numbers, poses, strict=True), len(kept)):
                    yield number, drain(portion(drawing.steps(pose), done, self.count), show)
            return
        with contextlib.closing(scheduler(asked.workers, asked.scheduler)) as runner:
            drawn = runner.in_order(draw, _job(asked), poses)
            for done, (number, frame) in enumerate(zip(numbers, drawn, strict=True), len(kept) + 1):
                yield number, frame
                if show:
                    show(done / self.count)


def draw(job: FlightJob, pose: FlightFrame) -> Drawn:
    """Draw one frame in a worker. The worker's thread keeps the map and the renderer until another flight comes."""
    if getattr(_of_thread, "key", None) != job.key:
        if hasattr(_of_thread, "drawing"):
            _of_thread.drawing.close()
            del _of_thread.drawing, _of_thread.key
        with contextlib.redirect_stderr(io.StringIO()):  # notes on the map were printed already
            _of_thread.drawing = Drawing(job.asked, open_scene(job.asked))
        _of_thread.key = job.key
    frame = drain(_of_thread.drawing.steps(pose))
    return frame._replace(image=np.ascontiguousarray(frame.image))


def _job(asked: FlyOptions) -> FlightJob:
    """The options for workers: without outputs, and with absolute file names."""
    frame = asked.frame
    files = {name: _absolute(getattr(frame, name)) for name in ("sky", "material", "drape")}
    sent = replace(
        asked,
        map=replace(asked.map, name=_absolute(asked.map.name)),
        store=replace(asked.store, edits=_absolute(asked.store.edits)),
        frame=replace(frame, **files),
        laid=replace(asked.laid, overlay=tuple(map(os.path.abspath, asked.laid.overlay))),
        output=_drawing(asked.output),
        keyframes=None,
    )
    return FlightJob(uuid.uuid4().hex, sent)


def _drawing(output: OutputOptions) -> OutputOptions:
    """The options of an output that change what is drawn."""
    return OutputOptions(backend=output.backend, facts=output.facts)


def _absolute(path: Any) -> Any:
    """The absolute name of a file; bundled names and missing options stay as they are."""
    return os.path.abspath(path) if path and os.path.exists(path) else path


def identity(asked: FlyOptions) -> Any:
    """A value for JSON that changes if the pictures of a flight change: its options, and the files that it reads."""
    store = replace(asked.store, memory=0)
    given = replace(
        asked, output=_drawing(asked.output), store=store, workers=1, scheduler=None
    )  # the others change no pixel
    name = asked.map.name
    of_map = [os.path.join(name, "zarr.json")] if is_store(name) else maps.files_read(name)
    files = [[path, *_status(path)] for path in (*of_map, *asked.files)]
    return {"version": __version__, "options": asdict(given), "files": files}


def _status(path: str) -> list[int]:
    """Size of a file, and the time when it was last written; empty if it cannot be read."""
    try:
        status = os.stat(path)
    except OSError:
        return []
    return [status.st_size, status.st_mtime_ns]
