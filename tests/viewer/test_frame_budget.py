"""The size of pictures in motion: the largest that fits the time, as the pictures before suggest."""

import math

import pytest

from terrain_gl.viewer.frame_budget import COARSEST, POWER, FrameBudget


def flown(budget, full_ms, frames=6):
    """Sizes of frames in motion over land whose full picture takes `full_ms`."""
    sizes = []
    for _ in range(frames):
        sizes.append(budget.shrink)
        budget.note(full_ms / budget.shrink**POWER, budget.shrink)
    return sizes


@pytest.mark.parametrize("full_ms, shrink", [(20, 1), (119, 1), (300, 2), (500, 3), (800, 4), (1e5, 4)])
def test_the_largest_picture_that_fits_is_drawn(full_ms, shrink):
    budget = FrameBudget(motion_ms=150.0)
    sizes = flown(budget, full_ms)
    assert sizes[0] == COARSEST and sizes[1:] == [shrink] * 5
    assert shrink == COARSEST or full_ms / shrink**POWER <= 150


def test_sizes_do_not_alternate_at_the_limit():
    """Times of 5 % above and below the limit: the size stays, because a larger picture needs a margin."""
    budget = FrameBudget(motion_ms=150.0)
    flown(budget, 160)
    assert {size for full_ms in (145, 160) * 5 for size in flown(budget, full_ms, 1)} == {2}
    assert flown(budget, 100)[-1] == 1


def test_a_new_map_begins_small():
    budget = FrameBudget()
    flown(budget, 10)
    assert budget.shrink == 1
    budget.forget()
    assert budget.shrink == COARSEST and budget.full_ms == math.inf
