"""A slow tour around the land in the middle of the picture, after a while without any input."""

import math

from .pose import Pose
from .scene import Scene

REST_S = 120.0  # in the window, a tour begins after this time
TURN_DEG_S = 3.0


class Tour:
    """The tour; `after_s` is infinite unless a window asks for tours, so that no notebook draws on its own."""

    def __init__(self, scene: Scene) -> None:
        self.after_s = math.inf
        self._scene = scene
        self._touched_s = 0.0
        self._before: tuple[Pose, str] | None = None  # the user's own view and mode, while the tour goes on

    @property
    def is_running(self) -> bool:
        return self._before is not None

    def touch(self) -> None:
        """Note that the user is there; the next tour begins later."""
        self._touched_s = self._scene.window.now_s

    def end(self) -> bool:
        """End the tour, and go back to the user's own view; returns whether there was a tour."""
        self.touch()
        if not self._before:
            return False
        controller = self._scene.controller
        pose, mode = self._before
        self._before = None
        controller.tour_deg_s = 0.0
        controller.change_mode(mode)
        controller.pose = pose
        return True

    def step(self, may_begin: bool) -> None:
        """Begin the tour if it is due."""
        scene = self._scene
        if not may_begin and not self.is_running:
            self.touch()
        if self.is_running or scene.window.now_s - self._touched_s < self.after_s:
            return
        controller = scene.controller
        if controller.ground_at(0.0, 0.0) is None:  # only sky is in the middle
            self.touch()
            return
        self._before = controller.pose, controller.mode
        controller.change_mode("orbit")
        controller.tour_deg_s = TURN_DEG_S
        scene.window.say("a tour, because nobody is here: any key ends it")
