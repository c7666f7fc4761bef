"""The shaders of method sat against `reference.rings`: rings, classes, spacings, joined squares, edges, prices."""

import numpy as np
import pytest
from asking import ask
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import cameras, rough
from ring_scenes import clipmap_of, patches_of

from terrain_gl import reference
from terrain_gl.camera import Camera
from terrain_gl.gpu import layout
from terrain_gl.heightmap import Heightmap
from terrain_gl.lod import Goal, RingsSelector
from terrain_gl.lod.ring_layout import BLOCK_SIDE, BLOCKS_ACROSS, rings_around
from terrain_gl.reference import rings as twin

pytestmark = pytest.mark.line

RNG = np.random.default_rng(8)


@pytest.fixture(scope="module")
def scene(session_context):
    with session_context as ctx:
        noise = np.random.default_rng(1).normal(size=(110, 90))
        scene = clipmap_of(ctx, Heightmap(rough(110, 90, 11) + 3 * noise.astype("f4"), (12.0, 9.0)))
        yield scene
        scene.release()


ANY_RINGS = given(
    st.tuples(st.floats(-50, 900), st.floats(-50, 900)),
    st.tuples(st.integers(1, 900), st.integers(1, 900)),
    st.tuples(st.floats(0.01, 100), st.floats(0.01, 100)),
    st.floats(0, 1e5),
)


def rings_of(at, last, spacing_m, away_m):
    return rings_around(at, away_m, last, spacing_m, top_level=max(1, (max(last) - 1).bit_length()))


@ANY_RINGS
def test_rings_stand_where_the_reference_puts_them(at, last, spacing_m, away_m):
    rings = rings_of(at, last, spacing_m, away_m)
    eye = tuple(min(max(a, 0), float(end)) for a, end in zip(at, last, strict=True))
    across = [max(BLOCKS_ACROSS, round(BLOCKS_ACROSS * max(spacing_m) / s)) for s in spacing_m]
    for ring in rings:
        origin, side = twin.ring_origin(eye, across, ring.level), BLOCK_SIDE << ring.level
        for i in range(2):
            rows = twin.rows_on_map(origin[i], across[i], ring.level, last[i])
            assert (ring.origin[i], ring.blocks[i]) == (origin[i] + side * rows[0], len(rows))


@ANY_RINGS
def test_a_ring_has_whole_cells_of_the_next_in_its_middle(at, last, spacing_m, away_m):
    rings = rings_of(at, last, spacing_m, away_m)
    for finer, ring in zip(rings, rings[1:], strict=False):
        assert ring.level == finer.level + 1
        for i in range(2):
            assert max(ring.origin[i], 0) <= max(finer.origin[i], 0)
            assert min(ring.end[i], last[i]) >= min(finer.end[i], last[i])
        assert all(place % (1 << ring.level) == 0 for place in (*finer.origin, *finer.end))


def test_rings_have_no_more_blocks_than_the_map(ctx):
    """Posts lie far apart one way and close the other: a ring as wide as it is high has half a million blocks."""
    heightmap = Heightmap(rough(54, 30, 3), (0.01, 80.0))
    scene = clipmap_of(ctx, heightmap, (64, 64))
    camera = Camera((0.15, -3000.0, 2000.0), (0.15, 2000.0, 0.0), 60.0)
    rings = rings_around((15.0, 27.0), 1.0, (29, 53), heightmap.spacing_m, scene.terrain.top_level)
    assert sum(ring.blocks[0] * ring.blocks[1] for ring in rings) < 100
    assert scene.select(camera, 1.0).triangles > 2


def class_levels(scene):
    """The GPU's counters, in the form of the reference's tables."""
    words, levels = np.frombuffer(scene.tables.counters.read(), "u4"), []
    limits_m = reference.class_limits(scene.terrain.span_m, scene.heightmap.spacing_m)
    for level in scene.terrain.levels:
        cols, rows = level.counts
        part = words[level.first_count :][: layout.CLASS_WORDS * cols * rows].reshape(-1, rows, cols)
        classes = [(four >> 8 * k & 255).astype("u1") for four in part for k in range(4)]
        levels.append(twin.ClassTables(classes, level.count_tile, scene.terrain.span_m, limits_m))
    return levels


def test_classes_of_any_box(ctx, scene):
    """Boxes wherever they stand, some of them partly beyond the map; steps above and below one post."""
    levels, last, n = class_levels(scene), scene.terrain.all_posts[2:], 600
    step = RNG.integers(-5, 5, n)
    low = RNG.integers(-8, 80, (n, 2)) >> np.maximum(step, 0)[:, None] << np.maximum(step, 0)[:, None]
    side = 1 << np.maximum(step, 0) + RNG.integers(0, 4, n)
    error_m = 10 ** RNG.uniform(-4, 2, n)
    statement = "ivec2 low = ivec2(a.xy); return vec4(is_within_m(low, low + int(a.z), int(a.w), b.x));"

    asked = np.column_stack([low, side, step])
    got = ask(
        ctx, "error/bound.glsl", statement, asked, np.column_stack([error_m] * 4), offered=scene.levels.of_passes
    )[:, 0]
    on_map = ((low < last) & (low + side[:, None] > 0)).all(1)
    expected = [
        twin.is_within(levels, tuple(a), tuple(a + s), last, int(j), float(np.float32(e)))
        for a, s, j, e in zip(low, side, step, error_m, strict=True)
    ]
    assert np.array_equal(got[on_map] > 0, np.array(expected)[on_map])
    assert 0.1 < got[on_map].mean() < 0.9


def test_coarsest_step_is_the_references(ctx, scene):
    low, side_log2 = RNG.integers(-40, 40, (200, 2)) << RNG.integers(0, 5, (200, 1)), RNG.integers(0, 8, 200)
    scene.select(cameras(scene.heightmap)["default"], 0.5)
    asked = np.column_stack([low, side_log2, side_log2])
    statement = "return vec4(coarsest_step(ivec2(a.xy), int(a.z)));"
    got = ask(ctx, "lod/rings/leaf.glsl", statement, asked, asked, offered=scene.levels.of_passes)[:, 0]
    top = scene.terrain.top_level
    assert got.tolist() == [
        twin.coarsest_step((int(x), int(y)), int(side), top) for (x, y), side in zip(low, side_log2, strict=True)
    ]


def test_next_step_asks_from_the_coarsest_down(ctx, scene):
    levels, last, n = class_levels(scene), scene.terrain.all_posts[2:], 1500
    camera = cameras(scene.heightmap)["default"]
    scene.select(camera, 0.5)
    finest_ring = scene.levels._rings_of(camera, BLOCKS_ACROSS)[0].level
    side_log2 = RNG.integers(0, 6, n)
    coarsest = np.minimum(RNG.integers(-2, 5, n), side_log2)
    low = RNG.integers(0, 60, (n, 2)) >> side_log2[:, None] << side_log2[:, None]
    nearest_m = 10 ** RNG.uniform(1, 5, n)
    statement = """Projection p = Projection(false, true, b.x, 1.0, b.x, 0.0, 0.0);
    int finest = finest_of(ivec2(a.xy), int(a.z), 0, int(a.w));
    return vec4(next_step(ivec2(a.xy), int(a.z), int(a.w), finest, p), error_within_m(p, u_tolerance_px), 0.0, 0.0);"""

    asked = np.column_stack([low, side_log2, coarsest])
    got = ask(
        ctx, "lod/rings/leaf.glsl", statement, asked, np.column_stack([nearest_m] * 4), offered=scene.levels.of_passes
    )
    twists_m = reference.twists(scene.terrain.filled - np.float32(scene.terrain.base_m))
    few = 0
    for k in range(n):
        place, side, within_m = tuple(low[k].tolist()), int(side_log2[k]), got[k, 1]

        def by_cells(step, place=place, side=side, within_m=within_m):
            few_m = twin.few_cells_m(twists_m, place, side, step)
            if few_m < np.inf:
                return few_m <= within_m
            return twin.is_within(levels, place, tuple(at + (1 << side) for at in place), last, step, within_m)

        finest = twin.finest_step(side, finest_ring)
        expected = twin.next_step(int(coarsest[k]), finest, by_cells)
        assert got[k, 0] == (NEVER_STEP if expected is None else expected)
        few += expected is not None and expected <= 0 and side <= twin.FEW_LOG2
    assert len(np.unique(got[:, 0])) > 5 and few > 10


class Watched(RingsSelector):
    """A selector that keeps the blocks and the units' words of every round before neighbours change them."""

    def _run(self, name, *args, **uniforms):
        if name == "agree" and uniforms["agreed"] == 0:
            data = self._buffers["blocks"].read()
            work = np.frombuffer(data, layout.RING_WORK, 1)[0]
            self.rounds = work["round"]["groups"].tolist()
            self.words = np.frombuffer(self._buffers["units"].read(), "u4").reshape(-1, 8, 8)
            self.blocks = np.frombuffer(data, layout.RING_BLOCK, offset=layout.RING_WORK.itemsize)
        super()._run(name, *args, **uniforms)


NEVER_STEP, ALONE = 47, 48  # NO_STEP of glsl/lod/rings/rings.glsl; a square that may not be a leaf
LOOK = """take_block(Block(ivec2(b.xy), int(b.z), int(b.w), NO_STEP));
    int depth = int(a.z);
    ivec2 low = low_of(depth, ivec2(a.xy)), end = low + (1 << side_log2_at(depth));
    if (is_nothing(low, end)) return vec4(-1.0);
    int coarsest = coarsest_step(low, side_log2_at(depth));
    Projection p = project_square(low, side_log2_at(depth));
    bool may = depth == 3 || fits_finer_ring(low, end);
    int finest = finest_of(low, side_log2_at(depth), block.ring, coarsest);
    return vec4(may ? next_step(low, side_log2_at(depth), coarsest, finest, p) : 48);"""


@pytest.mark.parametrize("view", ["default", "grazing", "far"])
def test_squares_are_joined_as_the_reference_joins_them(ctx, scene, view):
    watched, camera = Watched(scene.tables), cameras(scene.heightmap)[view]
    watched.select(camera, scene.size, scene.near_m, Goal(0.5, cull=False))
    places = [(i % (1 << d), i >> d, d, 0) for d in range(4) for i in range(4**d)]
    blocks = watched.blocks[: sum(watched.rounds)]
    about = np.column_stack([blocks["origin"], blocks["unit_log2"], blocks["ring"]])
    asked = np.repeat(about, len(places), 0).astype("f4"), np.tile(places, (len(blocks), 1)).astype("f4")
    steps = ask(ctx, "lod/rings/squares.glsl", LOOK, asked[1], asked[0], offered=watched.of_passes)
    steps = steps[:, 0].reshape(len(blocks), -1).astype(int)
    seen = set()
    for r, n in enumerate(watched.rounds):
        first = sum(watched.rounds[:r])
        for b in range(first, first + n):
            unit_log2, words, squares = int(blocks["unit_log2"][b]), watched.words[b].astype(int), {}
            drawn = words != 0
            for (x, y, depth, _), step in zip(places, steps[b], strict=True):
                side = BLOCK_SIDE >> depth
                if drawn[y * side : (y + 1) * side, x * side : (x + 1) * side].any():
                    squares[depth, x, y] = None if step in (NEVER_STEP, ALONE) else int(step)
            can_refine = unit_log2 >= 3 and r < twin.ROUNDS - 1
            expected = twin.cut_block(squares, unit_log2, can_refine)
            block, broken = words >> 31 != 0, words >> 29 & 1 != 0
            got = np.where(broken, -3, np.where(block, -2, np.where(drawn, words >> 8 & 3, -1)))
            assert np.array_equal(got, expected[..., 0])
            leaf = got >= 0
            assert np.array_equal((words & 63)[leaf] - 16, expected[..., 1][leaf])
            seen |= set(got.ravel().tolist())
    assert -1 in seen and len(seen & {0, 1, 2, 3}) > 1


@pytest.mark.parametrize("view", ["default", "grazing", "down"])
def test_edges_are_the_references(ctx, scene, view):
    selection = scene.select(cameras(scene.heightmap)[view], 0.5, cull=False)
    patches = patches_of(scene, selection)
    leaves = [
        twin.Leaf(tuple(low.tolist()), int(side), int(step))
        for low, side, step in zip(patches.corner, patches.side_log2, patches.step_log2, strict=True)
    ]
    over, unequal = twin.leaf_map(leaves, scene.heightmap.heights.shape), 0
    for i, leaf in enumerate(leaves):
        expected = [leaf.side_log2 - twin.edge_step_log2(leaves, over, i, side) for side in range(4)]
        assert patches.edges_log2[i].tolist() == expected
        unequal += expected != [leaf.side_log2 - leaf.step_log2] * 4
    assert unequal > 5


@settings(max_examples=20)
@given(st.integers(0, 10**6))
def test_cheapest_is_the_references(ctx, scene, seed):
    rng = np.random.default_rng(seed)
    weights = np.sort(10 ** rng.uniform(-3, 6, (50, 7)), 1)[:, ::-1].astype("f4")
    prices, sides = (10 ** rng.uniform(-4, 4, 50)).astype("f4"), rng.integers(0, 3, 50)
    buffer = ctx.buffer(weights.tobytes())
    statement = "int k; vec2 best = cheapest(int(a.x), int(a.z), a.y, k); return vec4(best, k, 0.0);"

    asked, selector = np.column_stack([np.arange(50), prices, sides, prices]), scene.levels.of_passes
    got = ask(ctx, "lod/rings/prices.glsl", statement, asked, offered={**selector, "SquaresPx2": buffer})
    for row, weight, side, price in zip(got, weights, sides, prices, strict=True):
        cost, segments_log2 = twin.cheapest(weight.astype("f8"), int(side), float(price))
        assert row[0] == pytest.approx(cost, rel=1e-5)
        assert row[1] == (4 if (side, segments_log2) == (0, 1) else 2 * 4**segments_log2) and row[2] == segments_log2
    buffer.release()
