"""The selection on the GPU and in the reference: from the same tables, they choose the same leaves."""

import numpy as np
import pytest
from maps import MAPS, Scene, cameras
from test_quadtree import patches_of

from terrain_gl import reference
from terrain_gl.comparison.pruned import view_of
from terrain_gl.gpu import layout
from terrain_gl.mesh import vertex_heights

BOUND_SLACK = 1.0005  # glsl/lod/project.glsl: for the roundings of float32
VIEWS = ["default", "grazing", "down", "wide", "pit", "outside", "far", "corner"]


@pytest.fixture(scope="module", params=["odd", "holes", "long"])
def scene(request, session_context):
    with session_context as ctx:
        scene = Scene.of(ctx, MAPS[request.param]())
        TABLES[id(scene)] = read_tables(scene)
        yield scene
        scene.release()


TABLES = {}  # read once for each scene


def gpu_tables(scene):
    """The tables of a scene of the fixture."""
    return TABLES[id(scene)]


def read_tables(scene):
    """The GPU's error table in the form of the reference's tables; gains and cells are the reference's own."""
    own = reference.tables_of(scene.terrain.filled.astype("f8"), np.isnan(scene.heightmap.heights))
    low_m = float(np.frombuffer(scene.terrain.block.read(), layout.TERRAIN)[0]["low_m"]) + scene.terrain.base_m
    tables = [own[0]]
    for level in range(1, len(own)):
        e = layout.unpack_nodes(scene.tables.read_nodes(level), scene.terrain.span_m)
        low, high = np.moveaxis(
            scene.tables.read_ranges(level)["heights"] * (scene.terrain.span_m / 65535) + low_m, -1, 0
        )
        gain = scene.tables.read_gains(level).astype("f8")
        tables.append(reference.Errors(*e[:6], low, high, ~e.has_voids, gain))
    ranges = [reference.tree.children_of(v, own[0].solid.shape) for v in (tables[1].low_m, tables[1].high_m)]
    return [tables[0]._replace(low_m=ranges[0], high_m=ranges[1]), *tables[1:]]


def leaves(scene, selection):
    """Column, row and side of the GPU's leaves, and the split edges of fans; None for quads and for all cells."""
    p, found = patches_of(scene, selection), set()
    for col, row, step, side, fan, edges in zip(p.col, p.row, p.step, p.side, p.fan, p.edges, strict=True):
        if fan and side > 1:
            found.add((col, row, side, edges))
        else:
            step = max(step, 1)
            found |= {(col + x, row + y, step, None) for x in range(0, side, step) for y in range(0, side, step)}
    return found


def leaves_of(selection):
    """Column, row and side of the drawn leaves, and the split edges of fans; None for quads."""
    found, exists = set(), reference.tree.existing(selection.splits)
    assert not any((drawn & ~level).any() for drawn, level in zip(selection.leaves, exists, strict=True))
    for level, (leaf, fan, edges) in enumerate(zip(selection.leaves, selection.fans, selection.edges, strict=True)):
        for row, col in np.argwhere(leaf):
            bits = sum(1 << k for k in range(4) if edges[row, col, k]) if fan[row, col] and level else None
            found.add((int(col) << level, int(row) << level, 1 << level, bits))
    return found


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("tolerance, metric", [(0.5, "max"), (4.0, "max"), (1.0, "rms"), (0.0, "max")])
def test_selection_is_the_references(ctx, scene, view, tolerance, metric):
    camera = cameras(scene.heightmap)[view]
    selection = scene.select(camera, tolerance, metric)
    screens = reference.on_screen(
        scene.heightmap.spacing_m, gpu_tables(scene), view_of(camera, scene.size, scene.near_m), metric
    )
    expected = reference.select(screens, scene.heightmap.heights.shape, tolerance / BOUND_SLACK, metric)
    assert leaves(scene, selection) == leaves_of(expected)
    assert selection.splits == sum(int(level.sum()) for level in expected.splits)
    if not (patches_of(scene, selection).step == 0).any():  # otherwise cells are cut for the error between their posts
        assert selection.triangles == expected.triangles
    if tolerance:  # the GPU counts errors between the posts of cells, too
        assert expected.certified_px <= selection.certified_px


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("tolerance, metric", [(0.5, "max"), (3.0, "max"), (1.0, "rms"), (0.0, "max")])
def test_patches_are_the_references(ctx, scene, view, tolerance, metric):
    """Squares of quads that are one patch: column, row, posts between vertices, segments."""
    camera, spacing_m = cameras(scene.heightmap)[view], scene.heightmap.spacing_m
    selection, tables = scene.select(camera, tolerance, metric), gpu_tables(scene)
    p = patches_of(scene, selection)
    places = zip(p.col, p.row, p.step, p.segments, p.fan, strict=True)
    got = {(c, r, step, t) for c, r, step, t, fan in places if not fan and step > 1}
    seen, limit_px = view_of(camera, scene.size, scene.near_m), tolerance / BOUND_SLACK
    screens = reference.on_screen(spacing_m, tables, seen, metric)
    leaves_of_view = reference.select(screens, scene.heightmap.heights.shape, limit_px, metric)
    sizes = reference.join(leaves_of_view)
    expected = {
        (int(x) << level + s, int(y) << level + s, 1 << level, 1 << s)
        for level, squares in enumerate(sizes)
        for s, joined in enumerate(squares)
        for y, x in np.argwhere(joined)
        if level > 0
    }
    assert got == expected


def test_without_agreeing_or_balance_the_reference_is_another(ctx, scene, monkeypatch):
    """Both passes matter: without one of them in the reference, its leaves are no longer the GPU's."""
    camera = cameras(scene.heightmap)["corner"]
    got = leaves(scene, scene.select(camera, 0.5))
    view = view_of(camera, scene.size, scene.near_m)
    screens = reference.on_screen(scene.heightmap.spacing_m, gpu_tables(scene), view)
    for name, without in (("agree", lambda *args: False), ("balance", lambda splits: False)):
        with monkeypatch.context() as patch:
            patch.setattr(reference.quadtree, name, without)
            assert leaves_of(reference.select(screens, scene.heightmap.heights.shape, 0.5 / BOUND_SLACK)) != got


@pytest.mark.parametrize("view", ["default", "grazing", "pit", "corner"])
def test_selection_for_a_budget_is_the_references_at_its_price(ctx, scene, view):
    camera, shape = cameras(scene.heightmap)[view], scene.heightmap.heights.shape
    selection = scene.select(camera, triangles=700)
    tables = gpu_tables(scene)
    screens = reference.on_screen(scene.heightmap.spacing_m, tables, view_of(camera, scene.size, scene.near_m))
    expected = reference.select_at_price(tables, screens, shape, selection.price)
    other = leaves(scene, selection) ^ leaves_of(expected)
    assert len(other) <= 0.01 * len(leaves(scene, selection)), "leaves whose gain is a rounding from the price"
    if selection.price > 0:
        price = reference.price_for(tables, screens, shape, 700)
        best = reference.select_at_price(tables, screens, shape, price).triangles
        assert 0.97 * best <= selection.triangles <= 700


@pytest.mark.parametrize("name", ["odd", "holes"])
def test_tables_of_the_reference_are_what_the_gpu_rounds_up(ctx, name):
    scene = Scene.of(ctx, MAPS[name]())
    own = reference.tables_of(scene.terrain.filled.astype("f8"), np.isnan(scene.heightmap.heights))
    rounding = 2e-6 * scene.terrain.span_m
    for mine, gpu in list(zip(own, read_tables(scene), strict=True))[1:]:
        for field in ("quad_max", "fan_max", "quad_rms", "fan_rms"):
            exact, rounded = getattr(mine, field), getattr(gpu, field)
            assert (exact <= rounded).all(), field
        for field in ("whole", "split"):
            assert (getattr(mine, field) <= getattr(gpu, field)).all(), field
        assert (gpu.low_m <= mine.low_m + rounding).all() and (mine.high_m <= gpu.high_m + rounding).all()
        assert (mine.solid == gpu.solid).all()
    scene.release()


# --- Mesh -------------------------------------------------------------------------------------------------------------


def corners(triangles):
    """Triangles as sets of their corners."""
    return {frozenset(map(tuple, triangle)) for triangle in triangles.tolist()}


@pytest.mark.parametrize("view", ["default", "grazing", "corner"])
def test_captured_triangles_are_those_of_the_reference(ctx, scene, view):
    """Fans are equal; quads, too, but for their diagonal (the driver's choice); other triangles are within cells."""
    selection = scene.select(cameras(scene.heightmap)[view], 0.5)
    last = np.array(scene.heightmap.heights.shape[::-1]) - 1
    got = corners(scene.triangles(selection))
    assert len(got) == selection.triangles
    for col, row, side, bits in leaves(scene, selection):
        if side == 1:
            continue
        low, high = np.array([col, row]), np.minimum([col + side, row + side], last)
        if bits is None:
            quad = reference.patch_triangles((col, row), 1, 1) - low
            rising = quad.copy()
            rising[..., 0] = 1 - rising[..., 0]
            either = [corners(low + triangles * (high - low)) for triangles in (quad, rising)]
            assert any(cut <= got for cut in either)
            got -= either[0] | either[1]
        else:
            middle = np.minimum(low + side // 2, last)
            fan = corners(reference.fan_triangles(low, high, middle, [bits >> k & 1 for k in range(4)]))
            assert fan <= got
            got -= fan
    for triangle in got:
        at = np.array(list(triangle))
        assert (np.floor(at.min(0)) + 1 >= at.max(0)).all()


def test_a_patch_of_the_reference_covers_its_square_once():
    for step, segments in ((1, 1), (4, 8), (2, 32)):
        triangles = reference.patch_triangles((3, 5), step, segments)
        areas = reference.mesh.areas(triangles)
        assert len(triangles) == 2 * segments**2 and (areas == step**2 / 2).all()
        assert triangles.min((0, 1)).tolist() == [3, 5]
        assert triangles.max((0, 1)).tolist() == [3 + step * segments, 5 + step * segments]


@pytest.mark.parametrize("bits", range(16))
def test_a_fan_of_the_reference_covers_its_square_once(bits):
    triangles = reference.fan_triangles((0, 0), (8, 8), (4, 4), [bits >> k & 1 for k in range(4)])
    assert len(triangles) == 4 + bits.bit_count()
    assert (reference.mesh.areas(triangles) > 0).all() and reference.mesh.areas(triangles).sum() == 64


def test_vertices_stand_at_the_references_heights(ctx, scene):
    places = np.array([[0, 0], [3, 2], [0.5, 0.5], [2.5, 1.5]])
    heights = scene.terrain.filled
    assert vertex_heights(heights, places) == pytest.approx(reference.vertex_heights(heights.astype("f8"), places))
