"""Make a film of a flight: draw and record each view of a path."""

from collections.abc import Callable, Iterable

import numpy as np

from ..basics.steps import Steps, portion
from .path import FlightFrame
from .record import Recorder

FPS = 30.0  # default frames a second
Draw = Callable[[FlightFrame], Steps[np.ndarray]]


def flight_steps(
    poses: Iterable[FlightFrame], count: int, draw: Draw, recorder: Recorder, wait: bool = True
) -> Steps[None]:
    """Draw and record a flight; yields progress from 0 to 1. The caller closes the recorder.

    Parameters
    ----------
    poses
        The views, `count` of them.
    draw
        Draws a view in steps, and returns its picture.
    wait
        Whether a step may wait for the encoder. If not, the next step offers the frame again.
    """
    for number, pose in enumerate(poses):
        image = yield from portion(draw(pose), number, count)
        while not recorder.append(image, wait=wait):
            yield (number + 1) / count
        yield (number + 1) / count
