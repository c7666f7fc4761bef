"""Lines of sight, against an independent march along each line."""

import numpy as np
import pytest

from terrain_gl import Heightmap, UsageError, reference
from terrain_gl import sight as lines

EARTH_M = 6378137.0


def hills(rows=120, cols=150, seed=1, spacing=(30.0, 20.0)):
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:rows, 0:cols]
    h = 60 * np.sin(x / 9 + rng.uniform(0, 6)) * np.cos(y / 13) + rng.normal(0, 4, (rows, cols))
    return Heightmap((300 + h).astype("f4"), spacing)


def height_of_line_m(drawn, spacing_m, a, b, share):
    """Height over the land of places on lines (n, 3) at shares (n, k); infinite beside the map."""
    places = a[:, None] + share[..., None] * (b - a)[:, None]
    cols, rows = places[..., 0] / spacing_m[0], drawn.shape[-2] - 1 - places[..., 1] / spacing_m[1]
    inside = (cols >= 0) & (cols <= drawn.shape[-1] - 1) & (rows >= 0) & (rows <= drawn.shape[-2] - 1)
    land = reference.bilinear_heights(drawn, np.where(inside, cols, 0), np.where(inside, rows, 0))
    return np.where(inside, places[..., 2] - land, np.inf)


def marched(drawn, spacing_m, a, b, steps=4000):
    """The smallest height of each line over the land: a march, then ever finer marches around its lowest places."""
    found = np.empty(len(a))
    for i in range(len(a)):
        line = a[i : i + 1], b[i : i + 1]
        shares = np.linspace(0, 1, steps)
        over = height_of_line_m(drawn, spacing_m, *line, shares[None])[0]
        best = over.min()
        lowest = np.flatnonzero(over < best + 2.0)  # a step is a metre, and slopes are below 2
        width = 1 / (steps - 1)
        around = shares[lowest]
        for _ in range(9):
            fine = np.clip(around[:, None] + width * np.linspace(-1, 1, 21), 0, 1)
            over = height_of_line_m(drawn, spacing_m, *line, fine.reshape(1, -1)).reshape(fine.shape)
            around = fine[np.arange(len(fine)), over.argmin(1)]
            width /= 8
            best = min(best, over.min())
        found[i] = best
    return found


def pairs(heightmap, n, seed=0, above=30.0):
    rng = np.random.default_rng(seed)
    ends = rng.uniform(0, 1, (2, n, 2)) * heightmap.extent_m
    return [np.c_[xy, heightmap.height_at(*xy.T) + rng.uniform(0, above, n)] for xy in ends]


@pytest.mark.slow
def test_lines_are_as_a_march_finds_them():
    """Nowhere wrong beyond a micrometre of grazing."""
    heightmap = hills()
    a, b = pairs(heightmap, 1500)
    sight = heightmap.sees(a, b)
    least = marched(heightmap.heights.astype(float), heightmap.spacing_m, a, b)
    wrong = (sight.seen != (least >= 0)) & (np.abs(least) > 1e-6)
    assert not wrong.any() and 0.1 < sight.seen.mean() < 0.9
    np.testing.assert_allclose(sight.clearance_m, least, atol=1e-6)


def test_lines_over_a_round_earth_with_refraction():
    """Each post is drawn lower by its drop as seen from a; between posts the land is bilinear."""
    heightmap = hills(60, 60, 2, (3000.0, 2500.0))
    a, b = pairs(heightmap, 120, 3, 400.0)
    bend = (1 - 0.13) / (2 * EARTH_M)
    sight = heightmap.sees(a, b, curvature="on", refraction=0.13)
    x, y, z = reference.world_m(heightmap.heights, heightmap.spacing_m)
    for i in range(len(a)):
        drop = bend * (np.square(x - a[i, 0]) + np.square(y - a[i, 1]))
        end = b[i].copy()
        col, row = end[0] / 3000.0, 59 - end[1] / 2500.0
        end[2] -= reference.bilinear_heights(drop, np.array([col]), np.array([row]))[0]
        least = marched(z - drop, heightmap.spacing_m, a[i : i + 1], end[None], 1500)[0]
        assert sight.clearance_m[i] == pytest.approx(least, abs=1e-6)
    flat = heightmap.sees(a, b, curvature="off")
    assert (flat.seen != sight.seen).any() and (heightmap.sees(a, b).seen == flat.seen).all()


def test_the_place_that_hides():
    """It is on the land and on the line, and nothing before it hides."""
    heightmap = hills(seed=4)
    a, b = pairs(heightmap, 400, 5, 10.0)
    sight = heightmap.sees(a, b)
    assert np.isnan(sight.hidden_by[sight.seen]).all()
    a, b, at = (each[~sight.seen] for each in (a, b, sight.hidden_by))
    np.testing.assert_allclose(heightmap.height_at(at[:, 0], at[:, 1]), at[:, 2], atol=1e-6)
    share = np.linalg.norm((at - a)[:, :2], axis=1) / np.linalg.norm((b - a)[:, :2], axis=1)
    np.testing.assert_allclose(a + share[:, None] * (b - a), at, atol=1e-5)
    before = height_of_line_m(
        heightmap.heights.astype(float), heightmap.spacing_m, a, b, share[:, None] * np.linspace(0, 1 - 1e-9, 3000)
    )
    assert (before >= -1e-6).all()


def test_lines_that_are_special():
    flat = Heightmap(np.full((20, 30), 5.0), 10.0)
    ridge = Heightmap(np.where(np.arange(30) == 15, 50.0, 0.0) + np.zeros((20, 1)), 10.0)
    for a, b, seen in [
        ((10, 10, 40), (280, 180, 40), True),
        ((10, 10, 5), (10, 10, 90), True),  # straight up
        ((10, 10, 90), (10, 10, 5), True),
        ((10, 10, 90), (10, 10, 4), False),
        ((0, 0, 5), (290, 0, 5), True),  # along the rim, on the ground
        ((290, 190, 6), (290, 0, 6), True),
        ((-500, 50, -40), (-20, 50, -80), True),  # beside the map
        ((-500, 50, -40), (900, 50, -80), False),  # under it
    ]:
        assert bool(flat.sees(a, b)) == seen, (a, b)
        assert bool(flat.sees(b, a)) == seen, (b, a)
    assert ridge.sees((0, 50, 1), (290, 50, 1)).hidden_by == pytest.approx((140.2, 50, 1.0))
    assert not ridge.sees((0, 50, 49), (290, 50, 49)) and ridge.sees((0, 50, 50), (290, 50, 50))
    assert ridge.sees((0, 50, 50), (290, 50, 50)).clearance_m == pytest.approx(0, abs=1e-9)
    with pytest.raises(ValueError):  # the truth of several
        bool(flat.sees([(0, 0, 9)] * 2, (9, 9, 9)))


def test_voids_hide_nothing():
    heights = np.zeros((30, 30))
    heights[:, 14:17] = 80.0
    heights[5:25, 12:19] = np.nan
    heightmap = Heightmap(heights, 10.0)
    assert heightmap.sees((10, 150, 2), (280, 150, 2))
    assert not heightmap.sees((10, 270, 2), (280, 270, 2))
    assert not heightmap.viewshed((10, 150, 2))[15, 15]


def test_portions_are_dropped_only_where_they_cannot_matter(monkeypatch):
    """Highest posts of blocks spare nine cells of ten, and change nothing; wrong ones do."""
    heightmap = hills(257, 257, 3)
    a, b = pairs(heightmap, 1000, 8, 100.0)
    cells, parabolas = [], lines._Lines._parabolas

    def counted(self, portion):
        cells.append(len(portion.line))
        return parabolas(self, portion)

    monkeypatch.setattr(lines._Lines, "_parabolas", counted)
    found = [heightmap.sees(a, b)]
    seen = [lines.seen_from(heightmap.heights, heightmap.spacing_m, a[0], b, 0.0)]
    some = sum(cells)
    highest = lines._highest(heightmap.heights)
    for blocks in ([], [each - 50 for each in highest]):
        cells.clear()
        monkeypatch.setattr(lines, "_highest", lambda heights, blocks=blocks: blocks)
        found.append(heightmap.sees(a, b))
        seen.append(lines.seen_from(heightmap.heights, heightmap.spacing_m, a[0], b, 0.0))
        if not blocks:
            assert 10 * some < sum(cells)
    for name in ("seen", "hidden_by", "clearance_m"):
        one, other, wrong = (getattr(each, name) for each in found)
        np.testing.assert_allclose(one, other, atol=1e-8)
        assert not np.array_equal(one, wrong, equal_nan=True)
    assert np.array_equal(seen[0], seen[1]) and not np.array_equal(seen[0], seen[2])


def test_the_highest_posts_of_blocks():
    heights = np.random.default_rng(0).normal(0, 50, (38, 71)).astype("f4")
    heights[20:30, 40:60] = np.nan
    for level, found in enumerate(lines._highest(heights), lines.SMALLEST):
        side = 1 << level
        for row, col in np.ndindex(found.shape):
            block = heights[row * side : row * side + side + 1, col * side : col * side + side + 1]
            assert found[row, col] == (-np.inf if np.isnan(block).all() else np.nanmax(block))
    assert found.shape == (1, 1)


def test_lines_that_touch_the_map_at_one_place():
    flat = Heightmap(np.full((20, 30), 5.0), 10.0)
    for a, b, height_m in [
        ((100, -90, 50), (120, 0, 4), -1.0),  # it ends on the rim, under the ground
        ((120, 0, 7), (100, -90, 50), 2.0),
        ((-50, 40, 8), (50, -60, 8), np.inf),  # past the corner
        ((-50, 50, 8), (50, -50, 8), 3.0),  # through the corner
    ]:
        found = flat.sees(a, b)
        assert found.clearance_m == pytest.approx(height_m) and bool(found) == (height_m > 0)
        if not found:
            assert found.hidden_by == pytest.approx((*b[:2], 5.0))


def test_what_a_place_sees():
    heightmap = hills(40, 50, 7)
    a = (400.0, 300.0, float(heightmap.height_at(400.0, 300.0)) + 15)
    seen = heightmap.viewshed(a, above_m=2.0)
    assert seen.shape == (40, 50) and 0.02 < seen.mean() < 0.9
    for row, col in np.random.default_rng(1).integers(0, [40, 50], (60, 2)):
        post = (col * 30.0, (39 - row) * 20.0, heightmap.heights[row, col] + 2.0)
        assert seen[row, col] == bool(heightmap.sees(a, post))


def test_heights_of_many_places():
    heightmap = hills()
    x, y = np.random.default_rng(2).uniform(-0.1, 1.1, (2, 7, 900)) * np.array(heightmap.extent_m)[:, None, None]
    found = heightmap.height_at(x, y)
    inside = (x >= 0) & (x <= heightmap.extent_m[0]) & (y >= 0) & (y <= heightmap.extent_m[1])
    expected = reference.bilinear_heights(heightmap.heights.astype(float), x[inside] / 30, 119 - y[inside] / 20)
    assert found.shape == x.shape and (np.isnan(found) == ~inside).all()
    np.testing.assert_allclose(found[inside], expected, atol=1e-9)
    assert heightmap.exaggerated(3.0).height_at(30.0, 20.0) == heightmap.height_at(30.0, 20.0)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda h: h.sees((0, 0), (1, 1, 1)), "a: expected places"),
        (lambda h: h.sees((0, 0, 0), (1, np.nan, 1)), "b: a place is not a finite"),
        (lambda h: h.sees(np.zeros((2, 3)), np.zeros((4, 3))), "as many places"),
        (lambda h: h.sees((0, 0, 0), (1, 1, 1), curvature="round"), "curvature"),
        (lambda h: h.sees((0, 0, 0), (1, 1, 1), refraction=1.5), "refraction"),
    ],
)
def test_wrong_questions(call, words):
    with pytest.raises(UsageError, match=words):
        call(hills(9, 9))
