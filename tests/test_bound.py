"""Bounds of boxes of nodes, and the error between the posts, by brute force."""

import numpy as np
import pytest

from terrain_gl import reference
from terrain_gl.gpu import layout

pytestmark = pytest.mark.line


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 8, 32])
def test_mean_over_the_measured_places_of_a_cell(n):
    """At most t²/64 over n⁴ over the places of `measure`, and as an integral, whichever diagonal each part has."""
    ends = np.full(6, 4 / 22)
    ends[[0, -1]] = 3 / 22
    for along in (ends, np.full(201, 1 / 200)):
        t, s = np.indices((len(along), len(along))) / (len(along) - 1)
        u, v = n * s % 1, n * t % 1
        bends = np.stack([np.minimum(u, v) - u * v, np.maximum(u + v - 1, 0) - u * v])
        squares = np.square(bends / n**2).max(0) if len(along) == 6 else np.square(bends / n**2)
        assert ((along[:, None] * along * squares).sum((-2, -1)) <= (1 + 1e-9) / 64 / n**4).all()


def four_planes(heights, s, t):
    """Heights over a cell drawn as a fan around the mean of its corners."""
    (a, b), (c, d) = heights
    x, y = 2 * s - 1, 2 * t - 1
    beyond = np.maximum(np.abs(x), np.abs(y))  # 0 in the middle, 1 on the rim
    along = np.where(np.abs(y) >= np.abs(x), x, y) / beyond  # -1 to 1 along the rim
    ends = np.select([-y >= np.abs(x), y >= np.abs(x), -x >= np.abs(y)], [a, c, a], b)
    others = np.select([-y >= np.abs(x), y >= np.abs(x), -x >= np.abs(y)], [b, d, c], d)
    rim = ends + (others - ends) * (along + 1) / 2
    return heights.mean() + beyond * (rim - heights.mean())


# --- Largest errors between the posts -------------------------------------------------------------------------------


def worst_distance(heights, drawn, n=400):
    """Largest distance of a drawn cell from the bilinear surface, over (n + 1)² places."""
    t, s = np.indices((n + 1, n + 1)) / n
    (a, b), (c, d) = heights
    return np.abs((1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * c + s * d) - drawn(s, t)).max()


def falling(heights, s, t):
    """A cell drawn as two triangles along its falling diagonal."""
    (a, b), (c, d) = heights
    return np.where(s >= t, a + (b - a) * s + (d - b) * t, a + (c - a) * t + (d - c) * s)


def in_parts(heights, n):
    """n × n equal parts of the cell's bilinear surface, each cut along its falling diagonal."""
    (a, b), (c, d) = heights

    def drawn(s, t):
        i, j = np.minimum(np.floor(s * n), n - 1), np.minimum(np.floor(t * n), n - 1)

        def at(x, y):
            return (1 - y) * ((1 - x) * a + x * b) + y * ((1 - x) * c + x * d)

        part = (at(i / n, j / n), at((i + 1) / n, j / n)), (at(i / n, (j + 1) / n), at((i + 1) / n, (j + 1) / n))
        return falling(part, s * n - i, t * n - j)

    return drawn


@pytest.mark.parametrize("seed", range(4))
def test_largest_errors_between_posts_are_reached_and_not_passed(seed):
    heights = np.random.default_rng(seed).normal(size=(2, 2)) * 30
    (twist,) = reference.twists(heights).ravel()
    assert worst_distance(heights, lambda s, t: falling(heights, s, t)) == pytest.approx(
        reference.diagonal_error(twist)
    )
    with np.errstate(all="ignore"):  # the middle itself has no direction
        around = worst_distance(heights, lambda s, t: np.nan_to_num(four_planes(heights, s, t), nan=heights.mean()))
    assert around == pytest.approx(reference.fan_error(twist), rel=1e-4)
    for n in (2, 4, 5):
        assert worst_distance(heights, in_parts(heights, n)) == pytest.approx(reference.parts_error(twist, n), rel=1e-3)


# --- Boxes of nodes -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("per_octave", [2, 4])
@pytest.mark.parametrize("size", [(1, 6), (6, 1), (12, 19), (33, 20)])
def test_bounds_of_boxes_hold_and_are_tight(size, per_octave):
    rng = np.random.default_rng(size[0])
    span_m = 100.0
    limits_m = span_m * 2.0 ** (-(np.arange(20 * per_octave) + 1) / per_octave)
    errors = span_m * 2 ** rng.uniform(-19, 0, size)
    squares, step_m2 = rng.uniform(0, 9, size), 2.0**-20
    tables = reference.class_tables(errors, limits_m)
    table = reference.square_table(squares, step_m2)
    for _ in range(60):
        (x0, x1), (y0, y1) = (np.sort(rng.choice(n + 1, 2, replace=False)) for n in size[::-1])
        worst = errors[y0:y1, x0:x1].max()
        bound = reference.bound_max_m(tables, (x0, y0), (x1, y1), span_m, limits_m)
        assert worst <= bound <= worst * 2 ** (1 / per_octave) * (1 + 1e-12)
        posts = (y1 - y0) * (x1 - x0)
        rms = np.sqrt(squares[y0:y1, x0:x1].mean())
        bound = reference.bound_rms_m(table, (x0, y0), (x1, y1), posts, step_m2)
        assert rms * (1 - 1e-12) <= bound <= np.sqrt(rms**2 + step_m2)


def test_a_class_table_decides_the_bound():
    """When the counters are overwritten with zeros, the bound falls to the last class."""
    errors = np.full((4, 4), 50.0)
    limits_m = reference.class_limits(100.0, (1.0, 1.0))
    tables = reference.class_tables(errors, limits_m)
    assert reference.bound_max_m(tables, (0, 0), (4, 4), 100.0, limits_m) >= 50
    empty = [np.zeros_like(table) for table in tables]
    assert reference.bound_max_m(empty, (0, 0), (4, 4), 100.0, limits_m) == limits_m[-1]


@pytest.mark.parametrize("span_m, spacing_m", [(3000.0, (30.0, 25.0)), (5.0, (30.0, 30.0)), (2000.0, (0.5, 0.5))])
def test_limits_are_dense_where_decisions_are_made(span_m, spacing_m):
    limits_m = reference.class_limits(span_m, spacing_m)
    assert np.allclose(layout.class_limits_m(span_m, spacing_m), limits_m, rtol=2.0**-18)
    assert len(limits_m) == layout.CLASSES and limits_m[0] < span_m and (np.diff(limits_m) < 0).all()
    top_m = min(16 * np.sqrt(spacing_m[0] * spacing_m[1]), span_m / 4)
    dense = (limits_m <= top_m * 1.001) & (limits_m >= top_m / 128 * 0.999)
    assert np.allclose(-np.diff(np.log2(limits_m[dense])), 1 / 8)
