"""Error tables against the reference: never below the truth, close above it, and equal after edits and rebuilds."""

import moderngl
import numpy as np
import pytest
from asking import Asked, ask
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import MAPS, Scene, checkerboard, cliff, holes, rough
from ring_scenes import change_shaders

from terrain_gl import reference
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.error import _BUFFERS, FINE_LEVELS, ErrorTables, _groups
from terrain_gl.gpu import gl, layout, shaders
from terrain_gl.heightmap import Heightmap
from terrain_gl.sat import Table
from terrain_gl.terrain import Terrain

pytestmark = pytest.mark.line

SHAPES = [(2, 2), (2, 7), (7, 2), (12, 19), (49, 2), (65, 65)]  # MAPS has long and larger ones
HALF = 1 + 2.0**-10 + 2.0**-18  # a half's last place, rounded up, and the rounding of the bound's own arithmetic
WIDER = 1 + 2.0**-17  # class limits, twice rounded
MEAN_HALF = HALF + 2.0**-13  # sums of squares in float32
ROUNDING = 2.0**-16  # what float32 may lose in a node's relief, in spans: ROUNDING_AT_RIM of 2^-24
SQUARE_STEP = 2.0**-17  # root of the fixed-point step of squared errors, 2^-35 span², and a little more


compiled = {}  # by context: tables whose shaders all tests use


def built(ctx, heightmap):
    """A map and its tables, to be released by `release_tables`."""
    terrain = Terrain(ctx, heightmap)
    if ctx not in compiled:
        compiled[ctx] = ErrorTables(terrain, build=False)
    tables = compiled[ctx].empty_for(terrain)
    tables.build()
    return terrain, tables


@pytest.mark.parametrize("fails", range(6))
def test_tables_for_which_memory_ends_half_way_leave_nothing(ctx, monkeypatch, fails):
    terrain, tables = built(ctx, Heightmap(rough(70, 60)))
    made, reserve = [], gl.reserve

    def short(ctx, size, what):
        if len(made) == fails:
            raise TerrainError("no more memory")
        made.append(reserve(ctx, size, what))
        return made[-1]

    before = tables.nodes.read()
    monkeypatch.setattr(gl, "reserve", short)
    with pytest.raises(TerrainError, match="no more"):
        tables.empty_for(terrain)
    assert len(made) == fails and all(isinstance(buffer.mglo, moderngl.InvalidObject) for buffer in made)
    assert tables.nodes.read() == before
    tables.release_tables()


def with_voids(heights, share=0.03, seed=0):
    rng = np.random.default_rng(seed)
    heights = heights.copy()
    heights[rng.random(heights.shape) < share] = np.nan
    return heights


def check_tables(terrain, tables):
    """Check that the errors are at least those of the reference, and little above them."""
    void = np.isnan(terrain.heightmap.heights)
    for level in range(1, len(terrain.levels)):
        max_m, rms_m = layout.unpack_nodes(tables.read_nodes(level), terrain.span_m)
        found, posts = reference.cut_errors(terrain.filled, level, void), own_posts(np.ones(void.shape, bool), level)
        mean = np.sqrt(found.squares / posts)
        assert (max_m >= reference.largest_errors(terrain.filled, level, void)).all(), level
        assert (max_m >= found.largest).all(), level
        assert (max_m <= found.largest * HALF + 4 * ROUNDING * terrain.span_m).all(), level
        assert (rms_m >= np.minimum(mean, found.largest)).all(), level
        assert (rms_m <= mean * MEAN_HALF + (SQUARE_STEP + 4 * ROUNDING) * terrain.span_m).all(), level


@pytest.mark.parametrize("alone", [False, True], ids=["", "a post alone"])
@pytest.mark.parametrize("has_rule", [True, False], ids=["", "every post in every node"])
def test_the_error_of_a_rim_beside_voids_is_that_of_the_land(ctx, monkeypatch, alone, has_rule):
    """The west node has no cell with data: the steps on its edge are an error of the east node alone."""
    if not has_rule:
        change_shaders(monkeypatch, "(is_own(n, place) || meets_data(n, place))", "true")
    heights = np.zeros((5, 9))
    heights[:, :4] = np.nan
    heights[1, 4] = 60
    if alone:
        heights[2, 1] = 40
    terrain = Terrain(ctx, Heightmap(heights, 10.0))
    tables = ErrorTables(terrain)  # with shaders of its own
    west, east = layout.unpack_nodes(tables.read_nodes(2), terrain.span_m)[0][0]
    assert east > 30
    assert (west > 10) == (alone or not has_rule)


def test_cut_edges_of_coarse_nodes_are_the_references(ctx):
    terrain, tables = built(ctx, Heightmap(rough(150, 203, seed=5), 10.0))
    off_m, first = np.frombuffer(tables.cuts.read(), "f4").reshape(-1, 4, 2), 0
    for level in range(FINE_LEVELS + 1, len(terrain.levels)):
        expected = reference.cut_edges(terrain.filled, level)
        nodes = expected[0, 0].size
        expected = expected.reshape(4, 2, nodes).transpose(2, 0, 1)
        assert off_m[first : first + nodes] == pytest.approx(expected, rel=1e-4, abs=ROUNDING * terrain.span_m)
        first += nodes
    assert first == len(off_m) > 10 and off_m.max() > 1


@pytest.mark.parametrize("voids", [False, True], ids=["solid", "voids"])
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_nodes_are_the_reference_rounded_up(ctx, shape, voids):
    heights = rough(*shape, seed=3)
    if voids:
        heights = with_voids(heights, 0.15 if min(shape) < 4 else 0.03)
    terrain, tables = built(ctx, Heightmap(heights, 10.0))
    check_tables(terrain, tables)


@pytest.mark.parametrize("name", MAPS)
def test_nodes_of_hard_maps_are_the_reference_rounded_up(ctx, name):
    terrain, tables = built(ctx, MAPS[name]())
    check_tables(terrain, tables)


@settings(max_examples=12)
@given(st.integers(2, 90), st.integers(2, 90), st.floats(-6, 6), st.floats(-4, 4), st.booleans(), st.integers(0, 999))
def test_nodes_of_any_map_are_the_reference_rounded_up(ctx, rows, cols, log_relief, offset, voids, seed):
    relief = min(10.0**log_relief, 4e6)
    heights = rough(rows, cols, seed, relief).astype("f8") + offset * relief
    if voids:
        heights = with_voids(heights, 0.1, seed)
        heights[0, 0] = 0.0
    terrain, tables = built(ctx, Heightmap(heights))
    check_tables(terrain, tables)
    tables.release_tables()
    terrain.release()


def test_small_errors_beside_a_large_one_are_not_lost(ctx):
    """In float32 1000 squares just below half the last place of their sum vanish: the mean must allow for that."""
    heights = np.zeros((33, 32 * 200 + 1))
    heights[1:-1] = 0.98 * 2.0**-12.5
    heights[:, ::32] = 0.0
    heights[0, 1::32] = 1 + 1e-5 * np.arange(200)
    check_tables(*built(ctx, Heightmap(heights)))


def test_reference_error_by_hand():
    h = np.zeros((3, 3))
    h[1, 1], h[0, 1] = 8.0, 2.0
    assert reference.largest_errors(h, 1).item() == 8  # the centre, drawn at 0; on the diagonals the error falls
    assert reference.cut_errors(h, 1).largest.item() == 8  # the north edge may rise by 2, but not at the centre


def test_reference_worse_diagonal():
    h = np.zeros((3, 3))
    h[0, 0] = h[2, 2] = 4.0  # the diagonals cross at 4 and at 0: the truth, 0, is 4 from one of them
    assert reference.largest_errors(h, 1).item() == 4.0  # beside it the twist is 4, and the error is smaller


def test_reference_error_is_largest_on_the_diagonal():
    """Three posts of the falling diagonal lie on it; beside it the truth sags by a quarter of the cells' twist of 4."""
    h = np.zeros((3, 3))
    h[0, 1] = h[1, 0] = -2.0
    h[0, 2] = h[2, 0] = -0.5
    assert reference.quad_errors(h, 1)[0][0, 1, 0, 1] == 0
    assert reference.largest_errors(h, 1).item() == max(4.0 / 4, 2.0 - 0.25)


def test_crest_by_brute_force():
    rng = np.random.default_rng(7)
    a, b, t = rng.normal(size=(3, 500, 1))
    s = np.linspace(0, 1, 2001)
    brute = (a * (1 - s) + b * s + t * s * (1 - s)).max(1)
    found = reference.crest(a, b, t)[:, 0]
    assert (found >= brute - 1e-12).all() and found == pytest.approx(brute, abs=1e-6)


@pytest.mark.parametrize("name", ["odd", "holes", "offset", "long"])
def test_ranges_hold_all_heights_drawn(ctx, name):
    terrain, tables = built(ctx, MAPS[name]())
    heights = terrain.filled.astype("f8") - terrain.base_m
    low_m = terrain.heightmap.range_m[0] - terrain.base_m
    step = terrain.span_m / 65535
    block = np.frombuffer(terrain.block.read(), layout.TERRAIN)[0]
    for level in range(1, len(terrain.levels)):
        y, x = (reference.nodes_along(n, level).post for n in heights.shape)
        posts = heights[y[:, :, None, None], x[None, None]]
        found = tables.read_ranges(level)["heights"] * step + float(block["low_m"])
        assert (found[..., 0] <= posts.min((1, 3)) + 1e-9 * abs(low_m)).all()
        assert (found[..., 1] >= posts.max((1, 3)) - 1e-9 * abs(low_m)).all()
        assert (found[..., 0] >= posts.min((1, 3)) - 1.15 * step).all()
        assert (found[..., 1] <= posts.max((1, 3)) + 1.15 * step).all()


@pytest.mark.parametrize("has_rule", [True, False])
def test_ranges_far_beyond_the_units_hold_all_heights(ctx, monkeypatch, has_rule):
    """A tenth of the heights lies in the units. Beyond them, the first and the last step stand for the map's ends."""
    if not has_rule:
        change_shaders(monkeypatch, "vec2(equal(steps, vec2(0.0, 65535.0)))", "vec2(0.0)")
    heightmap = MAPS["holes"]()
    usual = built(ctx, heightmap)[1]
    low_m, high_m = heightmap.range_m
    heightmap.quantised_m = low_m + 0.45 * (high_m - low_m), low_m + 0.55 * (high_m - low_m)
    terrain, tables = built(ctx, heightmap)
    y, x = (reference.nodes_along(n, 2).post for n in terrain.filled.shape)
    posts = terrain.filled[y[:, :, None, None], x[None, None]] - terrain.base_m
    at = np.indices((len(y), len(x)))[::-1].reshape(2, -1).T
    words = "vec2 r = unpack_range(range[node_index(2, ivec2(a.xy))]); return vec4(r, 0.0, 0.0);"
    resources = {**terrain.resources, "Counters": tables.counters, "Ranges": tables.ranges}
    found = ask(ctx, "error/bound.glsl", words, np.c_[at, at], resources=resources).reshape(*posts.shape[::2], 4)
    holds = (found[..., 0] <= posts.min((1, 3))) & (posts.max((1, 3)) <= found[..., 1])
    assert holds.all() == has_rule
    exchanged = (
        np.diff(each._read(each.ranges, layout.NODE_RANGE, 2)["heights"].astype(int)) < 0 for each in (usual, tables)
    )
    assert np.array_equal(*exchanged)  # the mark of voids, also where all heights are beyond


ASK_BOUNDS = """
layout(local_size_x = 64) in;
struct Box_ { ivec4 posts; ivec4 level; };  // column and row of the first and of the last post; step_log2
layout(std430, binding = 4) readonly buffer Boxes { Box_ asked[]; };
layout(std430, binding = 5) writeonly buffer Answers { vec4 answer[]; };
uniform uint u_asked;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= u_asked) return;
    ivec4 posts = asked[i].posts;
    int j = asked[i].level.x;
    float worst_m = largest_m(posts.xy, posts.zw, j);
    bool within = is_within_m(posts.xy, posts.zw, j, worst_m * 1.0001);
    bool within_less = is_within_m(posts.xy, posts.zw, j, worst_m * 0.8);
    answer[i] = vec4(worst_m, squares_m2(posts.xy, posts.zw, j), within, within_less);
}
"""


def ask_bounds(ctx, tables, boxes):
    """Largest error in m, sum of squares in m², and whether the box is within 1.0001 and 0.8 of that error, (n, 4)."""
    shader = Asked(ctx, "error/certified.glsl", shaders.source("error/certified.glsl") + ASK_BOUNDS)
    questions = np.zeros((len(boxes), 8), "i4")
    questions[:, :5] = boxes
    asked, answers = ctx.buffer(questions.tobytes()), ctx.buffer(reserve=16 * len(boxes))
    asking = {"Boxes": asked, "Answers": answers}
    read = {**tables.terrain.resources, **tables.resources, **asking}
    shader.run((-(-len(boxes) // 64), 1, 1), read, {"asked": len(boxes)})
    return np.frombuffer(answers.read(), "f4").reshape(-1, 4).astype("f8")


def random_boxes(terrain, count=300):
    """Rectangles of posts, x0, y0, x1, y1, anywhere on the map, and the spacing's level: from cells to the top."""
    rng, last = np.random.default_rng(8), np.array([terrain.heightmap.cols, terrain.heightmap.rows]) - 1
    ends = np.sort(rng.integers(0, last + 1, (count, 2, 2)), 1)
    ends[:, 1] = np.maximum(ends[:, 1], ends[:, 0] + 1)
    ends[:4] = [[0, 0], last]  # the whole map: more tiles than a counter of 8 bits can count
    low = np.minimum(ends[:, 0], last - 1)
    levels = np.r_[np.arange(4), rng.integers(0, len(terrain.levels), count - 4)]
    return np.c_[low, np.minimum(np.maximum(ends[:, 1], low + 1), last), levels]


def node_bounds(terrain, level):
    """Largest error, least and largest sum of squares that a table may have, of each node of a level; cells: 0."""
    void = np.isnan(terrain.heightmap.heights)
    if level == 0:
        solid = ~(void[1:, 1:] | void[1:, :-1] | void[:-1, 1:] | void[:-1, :-1])
        twist = np.abs(reference.twists(terrain.filled.astype("f8"))) * solid
        return twist / 4, twist**2 / 64, (twist * MEAN_HALF) ** 2 / 64
    worst, squares = reference.cut_errors(terrain.filled, level, void)
    posts = own_posts(np.ones(void.shape, bool), level)
    rms = np.sqrt(squares / posts)
    most = rms * MEAN_HALF + SQUARE_STEP * terrain.span_m
    return worst, np.minimum(rms, worst) ** 2 * posts, most**2 * posts


@pytest.mark.parametrize(
    "heights",
    [rough(130, 203, 1), cliff(), checkerboard(), holes(), with_voids(rough(140, 150), 0.6), rough(49, 2)],
)
def test_bound_of_a_box_holds_and_is_within_a_class(ctx, heights):
    """Any box, widened to whole tiles of nodes."""
    terrain, tables = built(ctx, Heightmap(heights, 10.0))
    span, boxes = terrain.span_m, random_boxes(terrain)
    of_level = [node_bounds(terrain, level) for level in range(len(terrain.levels))]
    limits = reference.class_limits(span, (10.0, 10.0))
    lowest = limits[-1] * WIDER
    for (x0, y0, x1, y1, level), told in zip(boxes.tolist(), ask_bounds(ctx, tables, boxes), strict=True):
        tile = terrain.levels[level].count_tile
        first, end = (y0 >> level, x0 >> level), ((y1 - 1 >> level) + 1, (x1 - 1 >> level) + 1)
        part = tuple(np.s_[a // tile * tile : -(-b // tile) * tile] for a, b in zip(first, end, strict=True))
        worst, least, most = (values[part] for values in of_level[level])
        largest_m, squares_m2, within, within_less = told
        worst_m = min(worst.max(), span)  # no surface through the posts strays further
        assert worst_m <= largest_m
        stored_m = worst_m * HALF * WIDER + 2 * ROUNDING * span
        assert largest_m <= max(min(limits[limits * WIDER >= stored_m], default=span) * WIDER, lowest)
        assert within and (not within_less or largest_m <= lowest)
        rounding = worst.size * 2.0**-34 * span**2  # a step of the fixed point for each node
        assert least.sum() * (1 - 2.0**-20) <= squares_m2 <= most.sum() * (1 + 2.0**-16) + rounding


@pytest.mark.parametrize("rule, without", [("", ""), ("may_overflow(low, end)", "false"), ("overflows ?", "false ?")])
def test_sums_of_squares_that_do_not_fit_are_bounded(ctx, monkeypatch, rule, without):
    """A checkerboard 60 times as high as the units. Without each rule, the sum of the whole map wraps at 2^64."""
    change_shaders(monkeypatch, rule, without)
    n = 800
    heightmap = Heightmap(60.0 * (np.indices((n, n)).sum(0) % 2), 10.0)
    heightmap.quantised_m = 0.0, 1.0
    terrain = Terrain(ctx, heightmap)
    tables = ErrorTables(terrain)  # with shaders of its own
    boxes = np.array([[0, 0, n - 1, n - 1, level] for level in range(1, 10)])
    largest_m, squares_m2 = ask_bounds(ctx, tables, boxes)[:, :2].T
    rms_m = layout.unpack_nodes(tables.read_nodes(10), terrain.span_m)[1][0, 0]
    assert largest_m == pytest.approx(60)
    least_m2 = 60.0**2 / 2  # half of the posts are off by 60 m: all others have the height of the corners
    assert ((squares_m2 >= least_m2 * (n - 1) ** 2).all() and rms_m**2 >= least_m2) == (not rule)
    tables.release()
    terrain.release()


def test_parts_of_a_cell_have_the_error_of_the_cell_over_n_squared(ctx):
    terrain, tables = built(ctx, Heightmap(rough(60, 70), 10.0))
    boxes = random_boxes(terrain, 40)
    whole, parts = (ask_bounds(ctx, tables, np.c_[boxes[:, :4], np.full(40, level)]) for level in (0, -3))
    assert parts[:, 0] == pytest.approx(whole[:, 0] / 64) and parts[:, 1] == pytest.approx(whole[:, 1] / 64**2)


def test_a_box_of_more_tiles_than_8_bits_count_sees_them_all(ctx):
    """256 tiles that are all above a class: their count wraps to zero, and asked at once the box would seem flat."""
    n = 16 * 4 + 1
    heights = np.zeros((n, n))
    heights[2::4, 2::4] = 50.0  # a twist in each tile of 4 x 4 cells
    tables = built(ctx, Heightmap(heights, 10.0))[1]
    counts = tables._sat8.read(tables.counters, Table(16, 16, layout.CLASS_WORDS))
    assert (counts[:, -1, -1] == 0).all() and counts.any()
    assert ask_bounds(ctx, tables, np.array([[0, 0, n - 1, n - 1, 0]]))[0, 0] >= 50 / 4


def own_posts(solid, level):
    """How many solid posts each node of a level owns."""
    own = solid.astype("i8")
    for axis in (0, 1):
        starts = reference.nodes_along(solid.shape[axis], level).low
        own = np.add.reduceat(own, starts, axis)
    return own


def all_bytes(tables):
    """Bytes of all tables. A small map has no coarse levels: nothing writes its blocks and edges, nor reads them."""
    has_coarse = len(tables.terrain.levels) > FINE_LEVELS + 1
    written = [name for name in _BUFFERS if has_coarse or name not in ("contributions", "cuts")]
    return tuple(getattr(tables, name).read() for name in written)


def edited(heights, rect, seed, kind):
    rng = np.random.default_rng(seed)
    after = heights.copy()
    part = after[rect]
    if kind == "heights":
        part += rng.normal(size=part.shape)
    elif kind == "voids":
        part[(rng.random(part.shape) < 0.3) | (part.size == 1)] = np.nan
    elif kind == "fill":
        part[np.isnan(part)] = 10.0
    elif kind == "span":
        part += 1e4
    return after


def anew(terrain, heights):
    """The same heights as a map that was never edited, but is to reach as far."""
    heightmap = Heightmap(heights, terrain.heightmap.spacing_m)
    heightmap.quantised_m = terrain.heightmap.quantised_m
    return heightmap


POSTS = [
    np.s_[0:1, 0:1],
    np.s_[-1:, -1:],
    np.s_[40:41, 64:65],
    np.s_[96:97, 96:97],  # one beyond a block of 32 posts that has a cell on the node's falling diagonal there
    np.s_[96:97, 32:33],  # and on the rising one: glsl/error/coarse.comp
]
AREAS = [np.s_[10:60, 20:30], np.s_[:, 100:101], np.s_[-5:, :], np.s_[30:80, -40:], np.s_[:, :]]
# a wider span changes all tables, wherever it comes from; the third post is a void
EDITS = {
    "heights": POSTS + AREAS,
    "voids": POSTS[3:] + AREAS,
    "fill": [POSTS[2], AREAS[0], AREAS[4]],
    "span": [POSTS[1], AREAS[1]],
}
EDITS["nothing"] = [AREAS[4]]


@pytest.mark.parametrize("kind, rect", [(kind, rect) for kind in EDITS for rect in EDITS[kind]], ids=str)
def test_edit_equals_a_rebuild(ctx, rect, kind):
    before = holes(150)
    after = edited(before, rect, 1, kind)
    terrain, tables = built(ctx, Heightmap(before, 10.0))
    changed = terrain.edit(0, 0, after)
    if changed:
        tables.update(changed)
    fresh = built(ctx, anew(terrain, after))
    assert all_bytes(tables) == all_bytes(fresh[1])
    assert terrain.heights.read() == fresh[0].heights.read()
    assert terrain.marks.read(alignment=1) == fresh[0].marks.read(alignment=1)
    assert terrain.block.read() == fresh[0].block.read()


@settings(max_examples=15)
@given(st.data())
def test_edits_one_after_another_equal_a_rebuild(ctx, data):
    rows, cols = data.draw(st.integers(2, 140)), data.draw(st.integers(2, 140))
    heights = rough(rows, cols, data.draw(st.integers(0, 99)))
    terrain, tables = built(ctx, Heightmap(heights))
    for _ in range(3):
        y, x = data.draw(st.integers(0, rows - 1)), data.draw(st.integers(0, cols - 1))
        rect = np.s_[y : y + data.draw(st.integers(1, rows)), x : x + data.draw(st.integers(1, cols))]
        heights = edited(
            heights, rect, data.draw(st.integers(0, 99)), data.draw(st.sampled_from(["heights", "voids", "fill"]))
        )
        heights[rows // 2, cols // 2] = 3.0
        changed = terrain.edit(0, 0, heights)
        if changed:
            tables.update(changed)
    fresh = built(ctx, anew(terrain, heights))
    assert all_bytes(tables) == all_bytes(fresh[1])
    for map_, its_tables in ((terrain, tables), fresh):
        its_tables.release_tables()
        map_.release()


def test_edit_touches_only_what_it_bears_on(ctx, monkeypatch):
    terrain, tables = built(ctx, Heightmap(rough(200, 200)))
    asked = []
    run = tables._run

    def noted(name, j, nodes, threads, tables, **more):
        if 0 not in threads:
            asked.append((name, j, nodes))
        run(name, j, nodes, threads, tables, **more)

    monkeypatch.setattr(tables, "_run", noted)
    heights = terrain.heightmap.heights.copy()
    heights[70, 81] += 1.0
    tables.update(terrain.edit(0, 0, heights))
    nodes = {j: rectangle[2:] for name, j, rectangle in asked if name in ("small", "fine", "coarse")}
    assert set(nodes) == set(range(1, len(terrain.levels)))
    assert max(w * h for w, h in nodes.values()) <= 4


@pytest.mark.parametrize("shape", [(1025, 1025), (513, 700)], ids=str)
def test_tables_take_at_most_14_bytes_a_post(ctx, shape):
    """A third of a node a post, 8 bytes each; 72 bytes a tile of 16 cells, or of 4 nodes; 0.2 for blocks and edges."""
    terrain, tables = built(ctx, Heightmap(rough(*shape)))
    assert tables.bytes <= (8 / 3 + 72 / 16 + 72 / 4 / 3 + 0.2) * shape[0] * shape[1] * 1.01
    assert tables.bytes == sum(buffer.size for buffer in tables._buffers)
    assert tables.contributions.size + tables.cuts.size <= 0.2 * shape[0] * shape[1]


def test_same_map_gives_the_same_bytes(ctx):
    assert len({all_bytes(built(ctx, Heightmap(holes()))[1]) for _ in range(3)}) == 1


def test_work_groups_stay_below_the_limit_on_the_largest_map(ctx, monkeypatch):
    """The largest map allowed is too large for a test: ask what would be dispatched for it."""
    scene = Scene.of(ctx, Heightmap(rough(5, 5)))
    most = 65535  # GL_MAX_COMPUTE_WORK_GROUP_COUNT, guaranteed
    scene.terrain.levels = layout.levels_over(16384, 16384)
    groups = []
    monkeypatch.setattr(
        scene.tables, "_run", lambda name, _j, _nodes, threads, _tables, **_: groups.append((name, *_groups(threads)))
    )
    for name in ("build", "edit"):
        monkeypatch.setattr(scene.tables._sat8, name, lambda *_: None)
        monkeypatch.setattr(scene.tables._sat64, name, lambda *_: None)
    monkeypatch.setattr(scene.terrain.heightmap, "heights", np.broadcast_to(np.float32(0), (16384, 16384)))
    scene.tables.build()
    assert {name for name, *_ in groups} == {"small", "fine", "coarse", "count"}
    assert max(max(count) for _, *count in groups) <= most
