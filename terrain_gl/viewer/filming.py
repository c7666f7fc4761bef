"""Records how the user flies: views and their times, from which a film is drawn afterwards."""

import importlib.util
from collections.abc import Iterator

from ..camera import Camera
from ..film.path import CameraPath, Keyframe

EVERY_S = 0.1  # seconds between keyframes; more in flights that would otherwise have more than `MOST` keyframes
MOST = 2000
LEAST_S = 0.2  # duration of the shortest film

Sun = tuple[float, float]


class Filming:
    """Records at most one flight at a time."""

    def __init__(self) -> None:
        self.near_m: float | None = None  # the smallest near plane distance of the flight; None for the default
        self._views: list[tuple[float, Camera, Sun]] | None = None

    @property
    def running(self) -> bool:
        """Whether a flight is being recorded."""
        return self._views is not None

    def begin(self) -> None:
        """Begin a flight."""
        self._views = []
        self.near_m = None

    def note(self, now_s: float, camera: Camera, sun: Sun, near_m: float | None) -> None:
        """Store the view of a frame. If the time is not later than that of the last view, this view replaces it."""
        if self._views is None:
            return
        if self._views and now_s <= self._views[-1][0]:
            self._views.pop()
        self._views.append((now_s, camera, sun))
        self.near_m = min((near for near in (self.near_m, near_m) if near), default=None)

    def stop(self) -> CameraPath | None:
        """End the flight, and return it as a path; None if it is too short."""
        views = self._views or []
        self._views = None
        if len(views) < 2 or views[-1][0] - views[0][0] < LEAST_S:
            return None
        begun_s = views[0][0]
        moving_sun = len({sun for _, _, sun in views}) > 1
        timed = ((now_s - begun_s, camera, sun) for now_s, camera, sun in _thinned(views))
        return CameraPath([Keyframe(camera, at_s, sun if moving_sun else None) for at_s, camera, sun in timed])


def _thinned(views: list[tuple[float, Camera, Sun]]) -> Iterator[tuple[float, Camera, Sun]]:
    """The first and the last view, and others between them at equal distances in time."""
    step_s = max(EVERY_S, (views[-1][0] - views[0][0]) / MOST)
    last_s = views[0][0]
    yield views[0]
    for view in views[1:-1]:
        if view[0] - last_s >= step_s and views[-1][0] - view[0] >= 0.5 * step_s:
            last_s = view[0]
            yield view
    yield views[-1]


def film_suffix() -> str:
    """Ending of the name of a film; "" without the extra [video]: then the film is a folder of pictures."""
    return ".mp4" if importlib.util.find_spec("av") else ""
