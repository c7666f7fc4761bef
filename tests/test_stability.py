"""A camera that moves slowly towards distant, rough mountains: their shading must not flicker."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from flicker import crawl, deviation, lights_of, rough_mountains, shimmer


@pytest.mark.slow
def test_far_mountains_do_not_shimmer(ctx):
    heightmap = rough_mountains()
    cameras = crawl(heightmap)[:12]
    assert shimmer(lights_of(heightmap, ctx, cameras, "point")) >= 4 * shimmer(lights_of(heightmap, ctx, cameras))


@pytest.mark.slow
def test_far_mountains_change_no_more_than_the_truth_does(ctx):
    """The truth: 256 places a pixel, each lit with its own normal, in every tenth of sixty frames."""
    heightmap = rough_mountains()
    cameras = crawl(heightmap)[::10]
    truth = deviation(lights_of(heightmap, ctx, cameras, "point", fine=8))
    assert deviation(lights_of(heightmap, ctx, cameras)) <= 1.2 * truth
