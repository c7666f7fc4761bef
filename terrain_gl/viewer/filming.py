"""Records how the user flies: views and their times, from which a film is drawn afterwards."""

import importlib.util

from ..camera import Camera
from ..film.path import CameraPath, Keyframe

EVERY_S = 0.1  # least time between two keyframes; the last keyframe may come after half of this time
LEAST_S = 0.2  # duration of the shortest film

Sun = tuple[float, float]


class Filming:
    """Records at most one flight at a time."""

    def __init__(self) -> None:
        self.near_m: float | None = None  # the smallest near plane distance of the flight; None for the default
        self._views: list[tuple[float, Camera, Sun]] | None = None

    @property
    def running(self) -> bool:
        return self._views is not None

    def begin(self) -> None:
        self._views = []
        self.near_m = None

    def note(self, now_s: float, camera: Camera, sun: Sun, near_m: float | None) -> None:
        """Store the view of a frame, or replace the last view if it came less than `EVERY_S` after the view before."""
        views = self._views
        if views is None:
            return
        if views and (now_s <= views[-1][0] or (len(views) > 1 and views[-1][0] - views[-2][0] < EVERY_S)):
            views.pop()
        views.append((now_s, camera, sun))
        self.near_m = min((near for near in (self.near_m, near_m) if near), default=None)

    def stop(self) -> CameraPath | None:
        """End the flight, and return its path; None if the flight is too short."""
        views = self._views or []
        self._views = None
        if len(views) < 2 or views[-1][0] - views[0][0] < LEAST_S:
            return None
        if len(views) > 2 and views[-1][0] - views[-2][0] < 0.5 * EVERY_S:
            del views[-2]
        begun_s = views[0][0]
        moving_sun = len({sun for _, _, sun in views}) > 1
        timed = ((now_s - begun_s, camera, sun) for now_s, camera, sun in views)
        return CameraPath([Keyframe(camera, at_s, sun if moving_sun else None) for at_s, camera, sun in timed])


def film_suffix() -> str:
    """Ending of the name of a film; "" without the extra [video]: then the film is a folder of pictures."""
    return ".mp4" if importlib.util.find_spec("av") else ""
