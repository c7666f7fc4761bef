"""How pictures in motion are drawn: in the best way that fits the time, as the pictures before suggest."""

import math

import pytest

from terrain_gl.renderer.options import FrameOptions
from terrain_gl.viewer.frame_budget import COARSEST, FULL, WAYS, FrameBudget
from terrain_gl.viewer.painter import FINEST_PX, hastened


def flown(budget, full_ms, frames=6):
    """The ways in which the first frames of a motion are drawn, over land whose full picture takes `full_ms`."""
    ways = []
    for _ in range(frames):
        ways.append(budget.way)
        budget.note(full_ms * budget.way.share, budget.way)
    return ways


def test_each_way_is_coarser_than_the_one_before():
    for finer, coarser in zip(WAYS, WAYS[1:], strict=False):
        assert coarser.share < finer.share
        assert coarser.shrink > finer.shrink or coarser.looser > finer.looser


@pytest.mark.parametrize("full_ms, i", [(20, 0), (119, 0), (155, 1), (180, 2), (300, 3), (440, 4), (560, 5), (1e5, 6)])
def test_the_best_picture_that_fits_is_drawn(full_ms, i):
    budget = FrameBudget(motion_ms=150.0)
    ways = flown(budget, full_ms)
    assert ways[0] == COARSEST and ways[1:] == [WAYS[i]] * 5
    assert WAYS[i] == COARSEST or full_ms * WAYS[i].share <= 150


def test_ways_do_not_alternate_at_the_limit():
    """Times of some per cent above and below the limit: the way stays, because a better picture needs a margin."""
    budget = FrameBudget(motion_ms=150.0)
    flown(budget, 145)
    assert {way for full_ms in (145, 160) * 5 for way in flown(budget, full_ms, 1)} == {WAYS[1]}
    assert flown(budget, 100)[-1] == FULL


def test_a_new_map_begins_coarse():
    budget = FrameBudget()
    flown(budget, 10)
    assert budget.way == FULL
    budget.forget()
    assert budget.way == COARSEST and budget.full_ms == math.inf


def test_a_panel_names_what_is_coarser_than_at_rest():
    """A budget of triangles has no tolerance, so only its picture's size changes."""
    tolerant, budgeted = ([way.words(tolerance_px) for way in WAYS] for tolerance_px in (8.0, None))
    assert tolerant[0] == "" and tolerant[1] == "tolerance 8 px" and tolerant[3] == "1/2 size, tolerance 8 px"
    assert budgeted[:4] == ["", "", "", "1/2 size"]


def test_a_picture_that_will_be_enlarged_is_no_finer_than_a_quarter_of_its_pixels():
    """At 1/32 px, such a picture had 0.8 million triangles, and no input was followed meanwhile."""
    fine, coarse = FrameOptions(1 / 32), FrameOptions(1.0)
    assert hastened(fine, COARSEST).max_error_px == FINEST_PX
    assert hastened(coarse, COARSEST).max_error_px == COARSEST.looser
    assert hastened(fine, FULL).max_error_px == 1 / 32 and hastened(fine, WAYS[1]).max_error_px == 1 / 16
