"""A flight becomes a film: each view of a path is drawn, and recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from ..steps import Steps, portion
from .path import Pose
from .record import Recorder

FPS = 30.0  # of a film that nobody gave a rate
Draw = Callable[[Pose], Steps[np.ndarray]]


def flight_steps(poses: Iterable[Pose], count: int, draw: Draw, recorder: Recorder, wait: bool = True) -> Steps[None]:
    """Draw and record a flight; yields progress from 0 to 1. The caller closes the recorder.

    Parameters
    ----------
    poses
        The views, `count` of them.
    draw
        Incremental: draws a view, and returns its picture.
    wait
        Whether a step may wait for the encoder; else it is asked again with the next step.
    """
    for number, pose in enumerate(poses):
        image = yield from portion(draw(pose), number, count)
        while not recorder.append(image, wait=wait):
            yield (number + 1) / count
        yield (number + 1) / count
