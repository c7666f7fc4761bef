"""How pictures in motion are drawn: in the best way that fits the time, as the pictures before suggest."""

import math

import pytest

from terrain_gl.viewer.frame_budget import COARSEST, FULL, STEPS, FrameBudget


def flown(budget, full_ms, frames=6):
    """Steps of frames in motion over land whose full picture takes `full_ms`."""
    steps = []
    for _ in range(frames):
        steps.append(budget.step)
        budget.note(full_ms * budget.step.share, budget.step)
    return steps


def test_each_step_is_coarser_than_the_one_before():
    for finer, coarser in zip(STEPS, STEPS[1:], strict=False):
        assert coarser.share < finer.share
        assert coarser.shrink > finer.shrink or coarser.looser > finer.looser


@pytest.mark.parametrize("full_ms, i", [(20, 0), (119, 0), (155, 1), (180, 2), (300, 3), (440, 4), (560, 5), (1e5, 6)])
def test_the_best_picture_that_fits_is_drawn(full_ms, i):
    budget = FrameBudget(motion_ms=150.0)
    steps = flown(budget, full_ms)
    assert steps[0] == COARSEST and steps[1:] == [STEPS[i]] * 5
    assert STEPS[i] == COARSEST or full_ms * STEPS[i].share <= 150


def test_steps_do_not_alternate_at_the_limit():
    """Times of some per cent above and below the limit: the step stays, because a better picture needs a margin."""
    budget = FrameBudget(motion_ms=150.0)
    flown(budget, 145)
    assert {step for full_ms in (145, 160) * 5 for step in flown(budget, full_ms, 1)} == {STEPS[1]}
    assert flown(budget, 100)[-1] == FULL


def test_a_new_map_begins_coarse():
    budget = FrameBudget()
    flown(budget, 10)
    assert budget.step == FULL
    budget.forget()
    assert budget.step == COARSEST and budget.full_ms == math.inf
