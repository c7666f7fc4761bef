"""The whole method in one file: it needs no package, its mesh keeps the certificate, and the table decides it."""

import ast
import importlib.util
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import moderngl
import numpy as np
import pytest
from maps import checkerboard, cliff, rough, spike

from terrain_gl import Camera, Heightmap, Renderer
from terrain_gl.files.maps import bundled
from terrain_gl.image import read_image
from terrain_gl.reference.heightmap import world_m
from terrain_gl.reference.project import Pinhole, screen_scale, shift_px

FILE = Path(__file__).parent.parent / "examples" / "11_the_method.py"
SIZE = (640, 360)
NEAR_M = 5.0
ROUNDING_PX = 1e-3  # of heights that the rasteriser interpolates

_specification = importlib.util.spec_from_file_location("the_method", FILE)
method = importlib.util.module_from_spec(_specification)
_specification.loader.exec_module(method)

_PLACE = "in vec3 v_place; out vec4 out_place; void main() { out_place = vec4(v_place, 1.0); }"
_EDGES = """
layout(local_size_x = 1) in;
layout(std430, binding = 4) buffer Edges { ivec4 edges_log2[]; };
void main() {
    int i = int(gl_GlobalInvocationID.x);
    for (int side = 0; side < 4; side++) edges_log2[i][side] = edge_log2(patches[i], side);
}
"""
_FROM_ABOVE = "gl_Position = vec4((vec2(at) + 0.5) / vec2(LAST + 1) * 2.0 - 1.0, 0.0, 1.0); }"


def view_of(map_):
    forward = np.subtract(map_.target, map_.eye)
    return method.look(np.array(map_.eye, float), forward, map_.fov_deg, SIZE)


def of_heights(heights, spacing_m=1.0):
    """A map that is seen from above its southern edge, at an angle."""
    north, east = (spacing_m * (n - 1) for n in heights.shape)
    eye = 0.45 * east, 0.1 * north, float(heights.max()) + 0.1 * north + 8.0
    target = 0.6 * east, 0.7 * north, float(heights.mean())
    return method.Map(heights.astype("f4"), spacing_m, eye, target, 50.0)


def drawn_m(terrain, count):
    """Heights of the mesh at all posts; NaN where nothing is drawn. An orthographic view from above."""
    evaluation = method.EVALUATION[: method.EVALUATION.rindex("gl_Position")] + _FROM_ABOVE
    texts = method.VERTEX, _PLACE, method.CONTROL, evaluation
    vertex, fragment, control, evaluation = (terrain.head + text for text in texts)
    array = terrain.ctx.vertex_array(terrain.ctx.program(vertex, fragment, None, control, evaluation), [])
    target = terrain.ctx.framebuffer(terrain.ctx.texture(terrain.heights.size, 4, dtype="f4"))
    target.use()
    target.clear(*[np.nan] * 4)
    terrain.ctx.enable_only(moderngl.NOTHING)
    terrain.ctx.patch_vertices = 1
    for first in range(0, count, method.PATCHES_PER_DRAW):
        array.render(moderngl.PATCHES, min(method.PATCHES_PER_DRAW, count - first), first=first)
    places = np.frombuffer(target.read(components=4, dtype="f4"), "f4").reshape(*terrain.map.heights.shape, 4)
    return places[..., 2].astype(float)


def compare(terrain, count, view):
    """Largest distance of a post from its place in pixels, and the posts inside the picture that are not drawn."""
    map_ = terrain.map
    axes, tan = view[1:4, :3].T.astype(float), view[4, :2].astype(float)
    seen_from = Pinhole(view[0, :3].astype(float), axes, SIZE[1] / 2 / tan[1], tan, NEAR_M)
    scale = screen_scale(seen_from, world_m(map_.heights.astype(float), (map_.spacing_m, map_.spacing_m)))
    drawn = drawn_m(terrain, count)
    covered = np.isfinite(drawn)
    px = shift_px(scale, np.where(covered, drawn - map_.heights, 0.0))
    inside = np.zeros_like(covered)
    inside[1:-1, 1:-1] = True
    return float(px[scale.seen].max(initial=0.0)), int((scale.seen & inside & ~covered).sum())


@pytest.fixture(scope="module")
def alpine():
    return method.open_map("alpine-30m")


def test_it_imports_no_package_of_ours():
    names = set()
    for node in ast.walk(ast.parse(FILE.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            names.add(node.module.split(".")[0])
    assert names - set(sys.stdlib_module_names) == {"moderngl", "numpy", "glfw"}


def test_it_reads_the_bundled_maps():
    for name in ("alpine-30m", "canyon-15m"):
        ours, known = method.open_map(name), bundled()[name]
        theirs = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
        assert np.abs(ours.heights - theirs.heights).max() < 1e-3


@pytest.mark.slow
def test_it_runs_as_a_script(tmp_path):
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, str(FILE), "--size", "640", "360"]
    result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")
    first, line, last = result.stdout.splitlines()
    assert "no display" in first and "triangles" in line and last == "wrote 11_the_method.png"
    pixels = read_image(tmp_path / "11_the_method.png")[..., :3].astype(float)
    sky, land = pixels[:90], pixels[200:]
    assert pixels.shape == (360, 640, 3)
    assert (sky[..., 2] > sky[..., 0]).all() and sky.std((0, 1)).max() < 30  # blue and smooth
    assert land.std((0, 1)).min() > 20


@pytest.mark.parametrize("tolerance_px", [0.5, 1.0, 2.0, 8.0, 40.0])
def test_its_error_is_at_most_the_certified_one(ctx, alpine, tolerance_px):
    terrain, view = method.Terrain(ctx, alpine), view_of(alpine)
    certified_px, count = terrain.select(view, tolerance_px)
    achieved_px, uncovered = compare(terrain, count, view)
    assert 0.1 * tolerance_px < achieved_px - ROUNDING_PX <= certified_px <= tolerance_px
    assert uncovered == 0


@pytest.mark.parametrize(
    "heights",
    [rough(300, 411, relief=60), rough(97, 64, 3), rough(600, 600, 5, 200), spike(), checkerboard(), cliff()],
    ids=["rough", "small", "large", "spike", "checkerboard", "cliff"],
)
def test_hard_maps(ctx, heights):
    map_ = of_heights(heights)
    terrain, view = method.Terrain(ctx, map_), view_of(map_)
    for tolerance_px in (1.0, 5.0, 25.0):
        certified_px, count = terrain.select(view, tolerance_px)
        achieved_px, uncovered = compare(terrain, count, view)
        assert achieved_px - ROUNDING_PX <= certified_px <= tolerance_px
        assert uncovered == 0


def test_views_at_random(ctx):
    rng, map_ = np.random.default_rng(0), of_heights(rough(500, 700, 7, 90))
    terrain, patches = method.Terrain(ctx, map_), 0
    for _ in range(12):
        east, north = rng.uniform(-50, 750), rng.uniform(-50, 550)
        forward = rng.normal(size=3) * (1, 1, 0.4) - (0, 0, 0.3)
        eye = np.array([east, north, map_.heights.max() + rng.uniform(6, 200)])
        view = method.look(eye, forward, rng.uniform(25, 90), SIZE)
        certified_px, count = terrain.select(view, 2.0)
        if not count:
            continue
        achieved_px, uncovered = compare(terrain, count, view)
        assert achieved_px - ROUNDING_PX <= certified_px <= 2.0
        assert uncovered == 0
        patches += count
    assert patches > 100


def edges_of(terrain, count):
    """Pairs of posts that the patches' edges join, each as often as it is drawn."""
    patches = np.frombuffer(terrain.buffers[2].read(), np.int32)[2 : 2 + 4 * count].reshape(-1, 4)
    functions = method.CONTROL[method.CONTROL.index("Patch beside") : method.CONTROL.index("void main")]
    edges = terrain.ctx.buffer(reserve=16 * count)
    edges.bind_to_storage_buffer(4)
    terrain.ctx.compute_shader(terrain.head + functions + _EDGES).run(count)
    terrain.ctx.memory_barrier()
    edges_log2 = np.frombuffer(edges.read(), np.int32).reshape(count, 4)
    found = Counter()
    last = np.array(terrain.map.heights.shape[::-1]) - 1
    for (x, y, side_log2, _), sides_log2 in zip(patches.tolist(), edges_log2.tolist(), strict=True):
        side = 1 << side_log2
        starts = ((x, y), (x, y), (x + side, y), (x, y + side))
        for start, way, log2 in zip(starts, ((0, 1), (1, 0)) * 2, sides_log2, strict=True):
            along = np.arange((1 << log2) + 1) * (side >> log2)
            posts = [tuple(post) for post in np.minimum(np.array(start) + along[:, None] * way, last).tolist()]
            found.update(pair for pair in zip(posts, posts[1:], strict=False) if pair[0] != pair[1])
    return found


@pytest.mark.parametrize("name", ["alpine", "spike", "cliff"])
def test_both_sides_of_an_edge_have_the_same_vertices(ctx, alpine, name):
    """Edges inside the mesh are drawn twice. Those that are drawn once are at the rim of the map or of the picture."""
    map_ = alpine if name == "alpine" else of_heights({"spike": spike, "cliff": cliff}[name](700))
    terrain, view = method.Terrain(ctx, map_), view_of(map_)
    for tolerance_px in (0.3, 1.0, 6.0):
        _, count = terrain.select(view, tolerance_px)
        cells = np.isfinite(drawn_m(terrain, count))[:-1, :-1]  # the patch of a post covers the cell south-east of it
        drawn = np.pad(cells, 1)
        found = edges_of(terrain, count)
        assert set(found.values()) == {1, 2}
        for ((x, y), (x1, _)), times in found.items():
            beside = drawn[y : y + 2, x + 1] if x1 > x else drawn[y + 1, x : x + 2]
            assert times == 2 or not beside.all()


def test_no_sky_within_the_land(ctx, alpine, monkeypatch):
    """Seen from high above, every pixel in the middle of the map is land."""
    rows, cols = (alpine.spacing_m * (n - 1) for n in alpine.heights.shape)
    terrain = method.Terrain(ctx, alpine)
    for colour in ("HAZE", "BLUE"):
        monkeypatch.setattr(method, colour, np.array([1.0, 0.0, 1.0]))
    target = ctx.simple_framebuffer(SIZE, 3)
    ctx.depth_func = ">="  # as another program in the context leaves it
    view = method.look((0.5 * cols, 0.5 * rows, 9000.0), (0.05, 0.1, -1.0), 40, SIZE)
    for tolerance_px in (0.7, 3.0, 12.0):
        terrain.draw(target, view, tolerance_px)
        pixels = np.frombuffer(target.read(), np.uint8).reshape(-1, 3)
        assert not (pixels == (255, 0, 255)).all(1).any()
    terrain.draw(target, method.look((0.5 * cols, 0.5 * rows, 9000.0), (0.05, 0.1, 1.0), 40, SIZE), 1.0)
    assert (np.frombuffer(target.read(), np.uint8).reshape(-1, 3) == (255, 0, 255)).all()


def test_the_table_decides(ctx, alpine):
    """With a table of zeros every patch is as coarse as can be, and the promise breaks."""
    terrain, view = method.Terrain(ctx, alpine), view_of(alpine)
    _, before = terrain.select(view, 1.0)
    terrain.buffers[0].clear()
    certified_px, count = terrain.select(view, 1.0)
    achieved_px, _ = compare(terrain, count, view)
    assert achieved_px > 10 * max(certified_px, 1.0)
    assert count != before


def test_its_levels_need_the_cut_edges(ctx):
    """Without the posts of cut edges the errors of cells are smaller."""
    found = []
    for old in ("off_m + cut_m", None):
        terrain = method.Terrain(ctx, of_heights(rough(200, 200, 1)))
        kernel = ctx.compute_shader(terrain.head + (method.ERRORS.replace(old, "off_m") if old else method.ERRORS))
        terrain.buffers[0].clear()
        kernel.run(13, 13, method.TOP)
        ctx.memory_barrier()
        found.append(np.frombuffer(terrain.buffers[0].read(), "u4").astype(int))  # 1 where a cell is above a class
    without, whole = found
    assert (whole >= without).all() and whole.sum() > 1.02 * without.sum()


@pytest.mark.slow
@pytest.mark.parametrize(("tolerance_px", "most"), [(1.0, 2.5), (4.0, 3.5)])
def test_triangles_beside_the_real_method(ctx, alpine, tolerance_px, most):
    """Real patches are closer to the error. But they also cut cells between posts."""
    known = bundled()["alpine-30m"]
    heightmap = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
    with Renderer(heightmap, size=SIZE) as renderer:
        camera = Camera(alpine.eye, alpine.target, fov_deg=alpine.fov_deg)
        real = renderer.draw(camera, max_error_px=tolerance_px, occlusion="off")["triangles"]
    with ctx:
        terrain = method.Terrain(ctx, alpine)
        line = terrain.draw(ctx.simple_framebuffer(SIZE, 3), view_of(alpine), tolerance_px)
    triangles = int(line.split()[0].replace(",", ""))
    assert 0.7 * real < triangles < most * real
