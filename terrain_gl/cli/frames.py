"""The frames of a flight, in order, drawn by this process, by several processes, or by workers of a Dask cluster.

Each worker has its own renderer. A frame does not depend on the frames before it. So whichever worker draws it, it has
the same pixels.
"""

import argparse
import contextlib
import io
import os
import threading
import uuid
from collections.abc import Callable, Collection, Generator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..basics.steps import Steps, drain, portion
from ..basics.version import __version__
from ..files import maps
from ..files.furniture import stamp
from ..film.path import CameraPath, FlightFrame
from ..store import is_store
from ..store.scheduling import scheduler
from . import furniture, options, overlays

OF_FLIGHT = (
    *("method", "metric", "certified_metric", "requested_max_error_px", "width", "height"),
    *("gl_renderer", "backend", "gpu_bytes"),
)
OF_FRAME = (
    *("triangles", "patches", "patches_hidden", "splits", "certified_max_error_px", "complete"),
    *("tiles_missing", "tiles_wide", "overlay_samples", "ms"),
)
MEASURED = ("max_error_px", "rms_error_px", "max_error_posts_px", "posts_measured", "land_measured", "holes")
_NO_PIXELS = ("output", "json", "run", "command_line", "workers", "scheduler", "memory")  # options that change no pixel
_of_thread = threading.local()


class Drawn(NamedTuple):
    """A frame."""

    image: np.ndarray
    numbers: dict[str, Any]  # of this frame
    about: dict[str, Any]  # numbers that all frames share


class FlightJob(NamedTuple):
    """Data that the workers of a flight share; `key` is new for each run."""

    key: str
    args: argparse.Namespace


class Drawing:
    """A renderer that draws the frames of a flight, each as if it were the only one."""

    def __init__(self, args: argparse.Namespace, scene: options.CommandScene) -> None:
        self._args = args
        self._view = options.view_of(args, scene)
        self._heightmap = scene.heightmap
        self._renderer = options.make_renderer(args, scene, lit=True)
        if self._renderer.streaming:
            self._renderer.streaming.is_repeatable = True

    def steps(self, pose: FlightFrame) -> Steps[Drawn]:
        """Draw a frame in steps."""
        args = self._args
        of_path = {"camera": pose.camera} | ({"sun": pose.sun} if pose.sun and not args.sun else {})
        frame = yield from self._renderer.render_steps(gradual=False, **self._view | of_path)
        stats = self._renderer.measure() if args.measure else frame.stats
        keys = OF_FRAME + (MEASURED if args.measure else ())
        numbers = {"eye": pose.camera.eye} | {key: stats[key] for key in keys if key in stats}
        image = frame.image[..., :3]
        names = overlays.names(args, self._renderer.labels())
        stamp(image, 0, [*names, *furniture.of(args, self._heightmap, pose.camera)])
        numbers["sees_land"] = self._renderer.picture.sees_land()
        return Drawn(image, numbers, {key: stats[key] for key in OF_FLIGHT})

    def close(self) -> None:
        """Release GPU resources."""
        self._renderer.release()


@dataclass(frozen=True)
class Flight:
    """A path that is drawn as `count` frames."""

    args: argparse.Namespace
    scene: options.CommandScene
    path: CameraPath
    count: int

    def frames(
        self, kept: Collection[int], show: Callable[[float], None] | None
    ) -> Generator[tuple[int, Drawn], None, None]:
        """Draw the frames except those `kept`, each with its number; `show` is called with the progress, 0 to 1."""
        args = self.args
        numbers = [number for number in range(self.count) if number not in kept]
        poses = (pose for number, pose in enumerate(self.path.poses(self.count)) if number not in kept)
        if not numbers:
            return
        if args.workers == 1 and not args.scheduler:
            with contextlib.closing(Drawing(args, self.scene)) as drawing:
                for done, (number, pose) in enumerate(zip(numbers, poses, strict=True), len(kept)):
                    yield number, drain(portion(drawing.steps(pose), done, self.count), show)
            return
        with contextlib.closing(scheduler(args.workers, args.scheduler)) as runner:
            drawn = runner.in_order(draw, _job(args), poses)
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
            _of_thread.drawing = Drawing(job.args, options.open_scene(job.args))
        _of_thread.key = job.key
    frame = drain(_of_thread.drawing.steps(pose))
    return frame._replace(image=np.ascontiguousarray(frame.image))


def _job(args: argparse.Namespace) -> FlightJob:
    """The options for workers: without outputs, and with absolute file names."""
    sent = argparse.Namespace(**vars(args) | {"output": None, "json": None, "run": None})
    for name in ("map", *options.FILES):
        if (path := getattr(sent, name)) and os.path.exists(path):
            setattr(sent, name, os.path.abspath(path))
    sent.overlay = [os.path.abspath(path) for path in args.overlay]
    return FlightJob(uuid.uuid4().hex, sent)


def identity(args: argparse.Namespace) -> Any:
    """A value for JSON that changes if the pictures of a flight change: its options, and the files that it reads."""
    given = {name: value for name, value in vars(args).items() if name not in _NO_PIXELS}
    of_map = [os.path.join(args.map, "zarr.json")] if is_store(args.map) else maps.files_read(args.map)
    files = [*of_map, *(path for name in options.FILES if (path := getattr(args, name))), *args.overlay]
    return {"version": __version__, "options": given, "files": [[path, *_status(path)] for path in files]}


def _status(path: str) -> list[int]:
    """Size of a file, and the time when it was last written; empty if it cannot be read."""
    try:
        status = os.stat(path)
    except OSError:
        return []
    return [status.st_size, status.st_mtime_ns]
