"""The explanation of a patch: the tables' own numbers, and the choice that follows from them."""

import itertools

import numpy as np
import pytest
from maps import MAPS, rough

import terrain_gl as tg
from terrain_gl.camera import screen_shift_px
from terrain_gl.gpu import layout
from terrain_gl.shade.picture import UNLIT

SIZE = (320, 200)
CAMERA = tg.Camera((600.0, -300.0, 260.0), (640.0, 640.0, 0.0))


@pytest.fixture
def renderer(ctx):
    with tg.Renderer(tg.Heightmap(rough(129, 129, 3), 10.0), SIZE, ctx=ctx) as renderer:
        yield renderer


def places(renderer, count=40):
    rng = np.random.default_rng(1)
    return rng.uniform(0, renderer.heightmap.extent_m, (count, 2))


def test_what_was_chosen_keeps_the_tolerance_and_is_among_the_choices(renderer):
    renderer.draw(CAMERA, 1.0, cull=False, style=UNLIT)
    kinds = set()
    for x, y in places(renderer, 150):
        told = renderer.inspector.explain(x, y)
        col, row = x / 10, 128 - y / 10
        assert (
            told.corner[0] <= col <= told.corner[0] + told.side and told.corner[1] <= row <= told.corner[1] + told.side
        )
        assert told.chosen in told.choices and told.chosen.px <= told.tolerance_px == 1.0
        assert told.chosen.segments * told.chosen.step == told.side
        kinds.add(told.chosen.segments)
    assert len(kinds) > 1


def test_errors_bound_the_truth_and_shrink_with_more_segments(renderer):
    renderer.draw(CAMERA, 2.0, cull=False, style=UNLIT)
    heights = renderer.heightmap.heights.astype(np.float64)
    block = np.frombuffer(renderer.terrain.block.read(), layout.TERRAIN)[0]
    ends_m = np.abs([block["low_m"], block["low_m"] + block["span_m"]])
    rounding_m = ends_m.max() * 2.0**-22
    for x, y in places(renderer, 15):
        told = renderer.inspector.explain(x, y)
        (col, row), side = told.corner, told.side
        if min(col, row) < 0 or col + side > 128 or row + side > 128:
            continue
        part = heights[row : row + side + 1, col : col + side + 1]
        quads = [choice for choice in told.choices if choice.step >= 1]
        for choice in quads:
            assert true_error(part, int(choice.step)) <= choice.max_m * (1 + 1e-6) and choice.rms_m <= choice.max_m
        for coarse, fine in itertools.pairwise([each for each in told.choices if each.step < 1]):
            # a cell in n × n parts errs by |t| / (4 n²); vertices between posts are rounded
            assert fine.max_m - rounding_m == pytest.approx((coarse.max_m - rounding_m) / 4, rel=1e-3)


def test_a_patch_of_the_clipmap_is_certified_with_its_edges(renderer):
    """The bound in its record is no less than what the tables say of its cells."""
    stats = renderer.draw(CAMERA, 2.0, method="sat", cull=False, style=UNLIT)
    told = [renderer.inspector.explain(x, y) for x, y in places(renderer, 80)]
    told = [each for each in told if each.in_picture]
    assert all(0 < each.bound_px <= stats["certified_max_error_px"] for each in told)
    assert all(each.chosen.px <= each.bound_px * 1.001 for each in told)
    assert all(each.segments * each.step == one.side for one in told for each in one.choices)


def test_the_explanation_asks_the_tables(renderer):
    """With the class counters overwritten, the explanation names other errors."""
    renderer.draw(CAMERA, 2.0, method="sat", cull=False, style=UNLIT)
    x, y = places(renderer, 1)[0]
    before = renderer.inspector.explain(x, y)
    counters = renderer.inspector.frame.selection.surface.tables.counters
    counters.write(np.random.default_rng(1).integers(0, 2**32, counters.size // 4, "u4").tobytes())
    after = renderer.inspector.explain(x, y)
    assert [each.max_m for each in after.choices] != [each.max_m for each in before.choices]


def test_a_look_up_of_four_fetches_decides_whether_a_level_is_enough(renderer):
    renderer.draw(CAMERA, 1.0, cull=False, style=UNLIT)
    heights = renderer.heightmap.heights.astype(np.float64)
    seen = set()
    for x, y in places(renderer, 60):
        told = renderer.inspector.explain(x, y)
        for choice in told.choices:
            if not (lookup := choice.lookup) or not told.in_picture:
                continue
            a, b, c, d = lookup.corners
            x0, y0, x1, y1 = lookup.tiles
            assert lookup.count > 255 or ((d - c) - (b - a)) % 256 == lookup.above
            assert (choice.px <= 1.0) == (lookup.above == 0)
            counts = renderer.inspector.error_counts(lookup, lookup.tiles).astype(int)
            assert (*counts[0, [0, -1]], *counts[-1, [0, -1]]) == lookup.corners
            if choice.step < 1:
                continue
            is_above = np.diff(np.diff(counts, axis=0), axis=1) % 256 > 0
            assert is_above.sum() == lookup.above
            side = (2 if lookup.level else 4) << lookup.level
            for row, col in np.ndindex(is_above.shape):
                part = heights[(y0 + row) * side :, (x0 + col) * side :][: side + 1, : side + 1]
                if part.shape == (side + 1, side + 1):  # else the map's rim cuts the tile off
                    assert is_above[row, col] or true_error(part, int(choice.step)) <= lookup.limit_m * (1 + 1e-5)
            seen.add(lookup.above > 0)
    assert seen == {True, False}


def true_error(part, step):
    """Largest distance of a part's posts from its cells of `step` posts, drawn along the worse diagonal."""
    n = len(part) - 1
    y, x = np.indices(part.shape)
    at_x, at_y = np.minimum(x // step, n // step - 1), np.minimum(y // step, n // step - 1)
    s, t = x / step - at_x, y / step - at_y
    corner = part[::step, ::step]
    a, b = corner[at_y, at_x], corner[at_y, at_x + 1]
    c, d = corner[at_y + 1, at_x], corner[at_y + 1, at_x + 1]
    falling = np.where(s >= t, a + (b - a) * s + (d - b) * t, a + (c - a) * t + (d - c) * s)
    rising = np.where(s + t <= 1, a + (b - a) * s + (c - a) * t, d + (c - d) * (1 - s) + (b - d) * (1 - t))
    return max(np.abs(falling - part).max(), np.abs(rising - part).max())


def test_a_metre_makes_at_most_as_many_pixels_as_told(renderer):
    renderer.draw(CAMERA, 2.0, style=UNLIT)
    for x, y in places(renderer, 15):
        told = renderer.inspector.explain(x, y)
        if told is None:
            continue
        (col, row), side = told.corner, told.side
        posts = np.indices((side + 1, side + 1)).reshape(2, -1).T + [row, col]
        posts = posts[(posts <= 128).all(1)]
        rows, cols = posts.T
        points = np.column_stack([10.0 * cols, 10.0 * (128 - rows), renderer.heightmap.heights[rows, cols]])
        px, seen = screen_shift_px(CAMERA, SIZE, points, np.full(len(points), 1e-3), 1.0)
        assert 1000 * px[seen].max(initial=0.0) <= told.px_per_m * 1.001
        assert told.range_m[0] <= points[:, 2].min() and points[:, 2].max() <= told.range_m[1]


def test_a_frozen_mesh_is_explained_for_the_eye_it_was_chosen_for(renderer):
    x, y = 640.0, 500.0
    renderer.draw(CAMERA, 2.0, cull=False, style=UNLIT)
    told = renderer.inspector.explain(x, y)
    elsewhere = tg.Camera((-900.0, 200.0, 900.0), (640.0, 640.0, 0.0))
    stats = renderer.draw(elsewhere, 2.0, cull=False, chosen_for=CAMERA, style=UNLIT)
    picture = renderer.picture.read()
    assert renderer.inspector.explain(x, y) == told
    assert stats["triangles"] == renderer.draw(CAMERA, 2.0, cull=False, style=UNLIT)["triangles"]
    renderer.draw(elsewhere, 2.0, cull=False, chosen_for=CAMERA, style=UNLIT)
    renderer.inspector.explain(x, y)
    assert np.array_equal(renderer.picture.read(), picture)
    assert renderer.measure()["max_error_px"] <= 2.0


def test_a_method_without_choices_is_not_explained(renderer):
    renderer.draw(CAMERA, method="full", style=UNLIT)
    assert renderer.inspector.explain(640.0, 640.0) is None


def test_nothing_is_explained_outside_the_map_or_the_picture(renderer):
    renderer.draw(CAMERA, 2.0, style=UNLIT)
    assert renderer.inspector.explain(-500.0, 100.0) is None
    renderer.draw(tg.Camera((600.0, -300.0, 260.0), (600.0, -900.0, 260.0)), 2.0, style=UNLIT)
    assert renderer.inspector.explain(640.0, 640.0) is None


@pytest.mark.parametrize("name", MAPS)
def test_every_map_is_explained(ctx, name):
    heightmap = MAPS[name]()
    with tg.Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        renderer.draw(tg.Camera.default(heightmap), 1.0, cull=False, style=UNLIT)
        for share in (0.0, 0.3, 0.99):
            told = renderer.inspector.explain(*(share * side for side in heightmap.extent_m))
            assert told.chosen.px <= 1.0
