"""Sky and ground images. Each image is read once, in a thread: the window does not wait, and errors become messages."""

import os
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

from ..light.laid import look_into
from ..light.lighting import ground_seen, sky_seen
from ..light.ramps import Photo
from ..renderer.options import NO_SKY
from .loading import in_a_line
from .scene import Scene


class ImageReader:
    """Reads a sky or ground image; then the scene is drawn with it."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._thread = ThreadPoolExecutor(1, "image")
        self._notes: tuple[str, ...] = ()
        self._reading: tuple[str, str, Future[Any]] | None = None  # option, path, the image

    @property
    def busy(self) -> bool:
        return self._reading is not None

    def read(self, option: str, path: str) -> None:
        """Read a file for an option of `FrameOptions`, "sky" or "material"; an empty path sets the default."""
        path = os.path.expanduser(path.strip())
        self._reading = option, path, self._thread.submit(self._read, option, path)

    def _read(self, option: str, path: str) -> None:
        if option == "sky" and path == NO_SKY:
            return
        if path and option == "sky":
            sky_seen((0.0, 0.0), path, north_deg=self._scene.heightmap.north_deg if self._scene.has_map else 0.0)
        elif path:
            photo = Photo(path, self._scene.settings.options.ramp_range)
            ground_seen(photo, self._scene.heightmap.georeference if self._scene.has_map else None)
            self._notes = look_into(*photo, is_picture=True)[1]

    def step(self) -> None:
        """Use an image that has been read, or show its error."""
        if not self._reading or not self._reading[2].done():
            return
        option, path, image = self._reading
        self._reading = None
        try:
            image.result()
        except Exception as error:
            self._scene.window.say(str(in_a_line(error, f"{path}: cannot be read")) or "not enough memory")
        else:
            self._scene.settings.change_all(**{option: path or None})
            if option == "material" and path and self._notes:
                self._scene.window.say("; ".join(self._notes))
            self._scene.window.refresh()

    def join(self) -> None:
        if self._reading:
            wait([self._reading[2]])
