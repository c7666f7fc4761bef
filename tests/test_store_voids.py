"""Stores with voids: filled, marked, drawn, measured and edited as maps in memory are."""

import numpy as np
import pytest
from commands import refused
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import rough
from test_export import read_ply
from test_pages import SIZE, all_pages, check_bounds, check_equal, load, pixels
from test_store import arrays_of, whole, write_tiff

from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.camera import Camera
from terrain_gl.error import ErrorTables
from terrain_gl.gpu.layout import HOLE, HOLED, VOID
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.terrain import Terrain
from terrain_gl.terrain.filling import fill_voids

pytest.importorskip("zarr")
from terrain_gl.store import StoredMap, build

SMALL = {"tile": 16, "shard": 64, "spacing_m": 2.0}


def torn(rows=150, cols=210):
    """Voids over several shards, at rims, of single posts, and a shard without any post."""
    heights = rough(rows, cols, seed=3)
    heights[20:90, 50:75] = np.nan
    heights[64:128, 128:192] = np.nan
    heights[:9, 100:] = np.nan
    heights[-1, ::7] = np.nan
    heights[100:110:3, 10:40:2] = np.nan
    return heights


@pytest.fixture(scope="module")
def maps(tmp_path_factory):
    """A map with voids as a whole, and its store."""
    path = tmp_path_factory.mktemp("torn") / "s"
    build(torn(), path, **SMALL)
    return Heightmap(torn(), 2.0), path


def test_heights_and_records_are_those_of_the_whole_map(ctx, maps):
    mine, path = maps
    arrays = arrays_of(path)
    terrain = Terrain(ctx, mine)
    tables = ErrorTables(terrain)
    np.testing.assert_array_equal(whole(arrays, "heights", 0), terrain.filled)
    for level in range(1, arrays.pyramid.top + 1):
        expected = tables.read_nodes(level).view("<u4")
        np.testing.assert_array_equal(whole(arrays, "errors", level), expected)
        heights = tables.read_ranges(level)["heights"]
        np.testing.assert_array_equal(np.moveaxis(whole(arrays, "ranges", level), 0, -1), heights)
    stored = StoredMap(path)
    assert stored.voids == mine.voids and stored.range_m == mine.range_m
    np.testing.assert_array_equal(stored.part(slice(0, 150), slice(0, 210)), mine.heights)
    np.testing.assert_array_equal(stored.heights[10:70, 40:110], mine.heights[10:70, 40:110])
    np.testing.assert_array_equal(stored.heights[[3, 80], [150, 60]], mine.heights[[3, 80], [150, 60]])


def test_a_node_is_a_hole_if_all_its_cells_are(maps):
    mine, path = maps
    arrays = arrays_of(path)
    void = np.isnan(mine.heights)
    hole = void[:-1, :-1] | void[:-1, 1:] | void[1:, :-1] | void[1:, 1:]
    for level in range(arrays.pyramid.top + 1):
        marks = arrays.read("marks", level, tuple(slice(0, n) for n in arrays.pyramid.posts(level)))
        rows, cols = (np.minimum(np.arange(n) << level, last) for n, last in zip(marks.shape, (149, 209), strict=True))
        np.testing.assert_array_equal((marks & VOID) > 0, void[np.ix_(rows, cols)])
        for row, col in np.ndindex(marks.shape[0] - 1, marks.shape[1] - 1):
            cells = hole[row << level : row + 1 << level, col << level : col + 1 << level]
            expected = (HOLE if cells.all() else 0) | (HOLED if cells.any() else 0)
            assert marks[row, col] & (HOLE | HOLED) == expected


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(st.data())
def test_any_voids_are_filled_as_in_memory(tmp_path_factory, data):
    rows, cols = data.draw(st.integers(2, 90)), data.draw(st.integers(2, 90))
    heights = rough(rows, cols, seed=data.draw(st.integers(0, 9)))
    for _ in range(data.draw(st.integers(1, 3))):
        y, x = data.draw(st.integers(0, rows - 1)), data.draw(st.integers(0, cols - 1))
        heights[y : y + data.draw(st.integers(1, 80)), x : x + data.draw(st.integers(1, 80))] = np.nan
    path = tmp_path_factory.mktemp("any") / "s"
    shard = data.draw(st.sampled_from([16, 32, 64]))
    if np.isnan(heights).all():
        with pytest.raises(TerrainError, match="every post is void"):
            build(heights, path, tile=8, shard=shard)
        return
    about = build(heights, path, tile=8, shard=shard)
    assert about["voids"] == np.isnan(heights).sum()
    np.testing.assert_array_equal(whole(arrays_of(path), "heights", 0), fill_voids(heights))


@pytest.mark.parametrize("voids", ["fill", "hole"])
def test_pictures_meshes_and_certificates_are_those_of_the_map_in_memory(maps, voids):
    check_equal(maps, 3, ["max", "rms"], voids=voids)


@pytest.mark.parametrize("style", ["voids", "wireframe", "promise"])
def test_styles_show_voids(maps, style):
    mine, path = maps
    camera = Camera((200, -120, 160), (200, 150, 0))
    with Renderer(mine, SIZE) as one, Renderer(StoredMap(path), SIZE) as other:
        load(other, all_pages(other.heightmap))
        how = {"style": style, "voids": "hole" if style == "wireframe" else "fill"}
        np.testing.assert_array_equal(pixels(one, camera, 1.0, how), pixels(other, camera, 1.0, how))


@pytest.mark.slow
def test_whatever_is_there_achieves_what_is_certified(maps, alone):
    check_bounds(maps, 2, 4, ["max", "rms"], occlusion="off")


@pytest.mark.slow
@pytest.mark.parametrize("voids", ["fill", "hole"])
def test_a_view_that_waits_is_certified_and_has_no_holes_but_the_voids(maps, voids):
    with Renderer(StoredMap(maps[1]), SIZE) as renderer:
        for eye in ((200.0, -60.0, 90.0), (-200.0, 150.0, 60.0)):
            stats = renderer.draw(Camera(eye, (200, 150, 0)), 1.0, style="lambert", voids=voids)
            found = renderer.measure()
            assert stats["complete"] and found["holes"] == 0 and found["voids"] == maps[0].voids
            assert found["max_error_px"] <= stats["certified_max_error_px"] <= 1.0


@pytest.mark.slow
def test_rims_of_holes_are_sharp_though_the_land_is_flat(tmp_path):
    """Level land needs no fine tiles; the rims of its holes do. Without them, they are large squares."""
    heights = np.full((200, 200), 5.0, np.float32)
    heights[95:100, 83:131] = np.nan
    build(heights, tmp_path / "s", **SMALL)
    camera = Camera((200, 199, 150), (200, 200, 0), 50.0)
    with Renderer(Heightmap(heights, 2.0), SIZE) as renderer:
        right = renderer.render(camera, 1.0, style="depth", voids="hole").image
    with Renderer(StoredMap(tmp_path / "s"), SIZE) as renderer, renderer.session:
        found = renderer.render(camera, 1.0, style="depth", voids="hole")
        assert found.stats["complete"]
        renderer.terrain.is_mixed = lambda numbers: np.zeros(numbers.shape, bool)
        renderer.streaming.is_repeatable = True
        coarse = renderer.render(camera, 1.0, style="depth", voids="hole").image
    assert (right != found.image).any(-1).mean() < 0.002 < 0.02 < (right != coarse).any(-1).mean()


def test_a_mesh_has_no_triangles_over_voids(maps, tmp_path, run):
    out = tmp_path / "m.ply"
    counts = {}
    for voids in ("fill", "hole"):
        assert run("mesh", maps[1], "-o", out, "--max-error-m", "4", "--voids", voids)[0] == 0
        counts[voids] = _area_m2(out)
    void = np.isnan(maps[0].heights)
    holes = void[:-1, :-1] | void[:-1, 1:] | void[1:, :-1] | void[1:, 1:]
    assert counts["fill"] == pytest.approx(4.0 * holes.size, rel=1e-6)
    assert counts["hole"] == pytest.approx(4.0 * (~holes).sum(), rel=1e-6)
    high = tmp_path / "high.ply"
    assert run("mesh", maps[1], "-o", high, "--max-error-m", "4", "--voids", "hole", "--exaggeration", "3")[0] == 0
    low_m, high_m = (read_ply(path.read_bytes())[0][:, 2] for path in (out, high))
    np.testing.assert_allclose(high_m, 3 * low_m, rtol=1e-6)


def _area_m2(path):
    """The area of a mesh as seen from above."""
    vertices, faces = read_ply(path.read_bytes())[:2]
    a, b, c = (vertices[faces[:, i], :2].astype(float) for i in range(3))
    return np.abs(np.cross(b - a, c - a)).sum() / 2


@pytest.mark.slow
def test_edits_beside_voids_hold_and_voids_stay(maps):
    mine, path = maps
    camera = Camera((200, -60, 90), (200, 150, 0))
    with Renderer(StoredMap(path), SIZE) as renderer:
        with pytest.raises(TerrainError, match="to voids"):
            renderer.edit(slice(30, 34), slice(45, 55), 80.0)
        with pytest.raises(UsageError, match="voids of a store"):
            renderer.edit(10, 10, np.nan)
        renderer.edit(slice(30, 60), slice(30, 50), 80.0)
        for _ in range(2):
            stats = renderer.draw(camera, 1.0, style="lambert")
            assert renderer.measure()["max_error_px"] <= stats["certified_max_error_px"]
            assert (
                np.isnan(renderer.height_at(2 * 60.0, 2 * (149 - 40.0))) and renderer.height_at(80.0, 2 * 109.0) == 80
            )
            renderer.rebuild()
    assert mine.voids == StoredMap(path).voids


def test_a_mosaic_may_lack_tiles(tmp_path):
    heights = rough(128, 128, seed=8)
    heights[:20, :20] = np.nan
    for row, col in ((1, 1), (0, 1), (0, 0)):
        part = heights[64 * row : 64 * row + 64, 64 * col : 64 * col + 64]
        write_tiff(tmp_path / f"{row}{col}.tif", part, 640.0 * col, 1000.0 - 640.0 * row)
    heights[64:, :64] = np.nan
    build(sorted(tmp_path.glob("*.tif")), tmp_path / "s", tile=16, shard=64)
    stored = StoredMap(tmp_path / "s")
    assert stored.voids == 4096 + 400
    np.testing.assert_array_equal(stored.part(slice(0, 128), slice(0, 128)), heights)


def test_the_command_tells_of_voids(folder, run):
    np.save("dem.npy", torn(40, 240)[:, :90])
    assert "posts without data" in run("build", "dem.npy", "-o", "s")[1]
    np.save("void.npy", np.full((20, 20), np.nan, np.float32))
    refused(run("build", "void.npy", "-o", "t"), 1, "void.npy", "every post is void")
