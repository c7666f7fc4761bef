"""The projection of points and boxes: the GPU's, the package's and the reference's."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from asking import Asked
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import MAPS, cameras

from terrain_gl import reference
from terrain_gl.camera import Camera, screen_shift_px
from terrain_gl.comparison.pruned import view_of
from terrain_gl.gpu import layout, shaders
from terrain_gl.lod import ViewBlock

ASK = np.dtype([("posts", "4i4"), ("range_m", "2f4"), ("error_m", "f4"), ("unused", "f4")])
ASK_PROJECTION = """
layout(local_size_x = 64) in;
struct Ask { ivec4 posts; vec2 range_m; float error_m, unused; };
layout(std430, binding = 0) readonly buffer Asked { Ask asked[]; };
layout(std430, binding = 1) writeonly buffer Answers { vec4 answer[]; };
uniform uint u_asked;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= u_asked) return;
    Ask a = asked[i];
    Projection p = project(box_of(a.posts.xy, a.posts.zw, a.range_m), 1.0);
    answer[i] = vec4(error_px(p, a.error_m, a.error_m), p.outside, p.inside, 0.0);
}
"""
INFINITE_PX = 1e30  # glsl/lod/project.glsl
SIZES = [(640, 360), (360, 640), (1280, 720), (4096, 16)]


@pytest.fixture(scope="module")
def projection(session_context):
    """Results of glsl/lod/project.glsl, (pixels, outside, inside), for boxes of posts on any grid, from any camera."""
    with session_context as ctx:
        shader = Asked(ctx, "lod/project.glsl", shaders.source("lod/project.glsl") + ASK_PROJECTION)
        view, block = ViewBlock(ctx), ctx.buffer(reserve=layout.TERRAIN.itemsize)

    def ask(asked, grid, camera, size, near_m):
        terrain = np.zeros((), layout.TERRAIN)
        terrain["last_post"], terrain["spacing_m"] = grid.rows - 1, grid.spacing_m
        block.write(terrain.tobytes())
        view.write(SimpleNamespace(heightmap=grid, base_m=0.0), camera, size, near_m)
        questions, answers = ctx.buffer(asked.tobytes()), ctx.buffer(reserve=16 * len(asked))
        read = {"Terrain": block, **view.resources, "Asked": questions, "Answers": answers}
        shader.run((-(-len(asked) // 64), 1, 1), read, {"asked": len(asked)})
        found = np.frombuffer(answers.read(), "f4").reshape(-1, 4).astype("f8")
        questions.release()
        answers.release()
        return found[:, 0], found[:, 1] > 0, found[:, 2] > 0

    return ask


def random_view(rng):
    """A grid of random spacing and relief, and a camera inside, above, beside, far away, or vertically above it."""
    spacing = 10 ** rng.uniform(-3, 3, 2) if rng.random() < 0.5 else np.full(2, 10 ** rng.uniform(-3, 3))
    cells = 2 ** int(rng.integers(1, 15))
    extent = cells * spacing.min()
    relief = extent * 10 ** rng.uniform(-4, 1)
    low = relief * 10 * rng.uniform(-1, 1) * rng.integers(0, 2)
    over = rng.uniform(0, cells, 2) * spacing
    eye = [
        lambda: np.r_[over, low + rng.uniform(-0.2, 1.5) * relief],
        lambda: np.r_[over, low + rng.uniform(1, 100) * extent],
        lambda: rng.normal(size=3) * 1e6,
        lambda: np.r_[rng.uniform(-3, 4, 2) * cells * spacing, low + rng.normal() * relief],
        lambda: np.r_[np.round(over / spacing) * spacing, low + 10 ** rng.uniform(-2, 3) * spacing.min()],
        lambda: np.r_[over, low + 10 ** rng.uniform(0, 7) * spacing.min()],
    ][rng.integers(0, 6)]()
    target = [
        lambda: np.r_[rng.uniform(0, cells, 2) * spacing, low + rng.uniform(0, 1) * relief],
        lambda: eye - [0, 0, max(extent, 1)],
        lambda: eye + np.r_[rng.normal(size=2) * 0.01, -1] * max(extent, 1),
        lambda: eye + rng.normal(size=3) * extent,
    ][rng.integers(0, 4)]()
    fov = float(rng.choice([0.1, 1, 20, 50, 100, 120, 150, 170]))
    up = None if rng.random() < 0.5 else tuple(rng.normal(size=3))
    span_m = low, low + relief
    grid = SimpleNamespace(
        spacing_m=tuple(spacing), rows=cells + 1, cols=cells + 1, range_m=span_m, relief=relief, low=low
    )
    near_m = 0.1 * spacing.min() * 10 ** rng.uniform(-1, 1)
    return grid, Camera(tuple(eye), tuple(target), fov, up), SIZES[rng.integers(0, len(SIZES))], near_m


def random_boxes(rng, grid, camera, count=256):
    """Nodes of all levels, half of them around the eye, flat and tall, with errors at most as large as their relief."""
    cells = grid.rows - 1
    asked = np.zeros(count, ASK)
    side = 1 << rng.integers(0, int(np.log2(cells)) + 1, count)
    eye = np.array([camera.eye[0] / grid.spacing_m[0], cells - camera.eye[1] / grid.spacing_m[1]])
    near = np.clip(eye + rng.normal(size=(count, 2)) * side[:, None], 0, cells - 1)
    low = np.where(rng.random((count, 1)) < 0.5, rng.integers(0, cells, (count, 2)), near).astype(int) // side[:, None]
    asked["posts"][:, :2] = low * side[:, None]
    asked["posts"][:, 2:] = np.minimum(asked["posts"][:, :2] + side[:, None], cells)
    heights = np.sort(rng.uniform(0, 1, (count, 2)), 1)
    heights[rng.random(count) < 0.5, 1] = 0
    heights[:, 1] = np.maximum(heights[:, 1], heights[:, 0] + 1e-3 * rng.random(count))
    asked["range_m"] = grid.low + grid.relief * heights
    asked["error_m"] = 10 ** rng.uniform(-6, 0, count) * np.ptp(asked["range_m"], axis=1)
    return asked


def random_posts(rng, grid, asked, each=40):
    """World points (boxes, each, 3) on posts of the boxes, many of them at corners."""
    at = rng.random((len(asked), each, 3))
    at = np.where(rng.random(at.shape) < 0.6, np.round(at), at)
    low, high = asked["posts"][:, None, :2], asked["posts"][:, None, 2:]
    posts = np.round(low + (high - low) * at[..., :2])
    bottom, top = asked["range_m"].astype("f8")[:, None].swapaxes(0, 2).swapaxes(1, 2)
    east, north = grid.spacing_m
    return np.stack(
        [posts[..., 0] * east, (grid.rows - 1 - posts[..., 1]) * north, bottom + (top - bottom) * at[..., 2]], -1
    )


@settings(max_examples=250)
@given(st.integers(0, 10**6))
def test_projection_bounds_every_point_of_a_box(ctx, projection, seed):
    rng = np.random.default_rng(seed)
    grid, camera, size, near_m = random_view(rng)
    asked = random_boxes(rng, grid, camera)
    bound_px, outside, inside = projection(asked, grid, camera, size, near_m)
    points = random_posts(rng, grid, asked)
    rise = asked["error_m"].astype("f8")[:, None] * rng.choice([-1, 1], points.shape[:2])
    px, seen = screen_shift_px(camera, size, points.reshape(-1, 3), rise.ravel(), near_m)
    px, seen = px.reshape(rise.shape), seen.reshape(rise.shape)
    worst = np.where(seen, px, 0.0).max(1)
    assert not (outside & seen.any(1)).any()
    assert not (inside & ~seen.all(1)).any()
    finite = np.isfinite(worst)
    assert (bound_px[~finite] >= np.float32(INFINITE_PX)).all()
    assert (worst[finite] <= bound_px[finite]).all()


@given(st.integers(0, 10**6))
def test_projection_of_a_small_box_is_tight(ctx, projection, seed):
    """Far from the eye and near its middle a node of one cell and little relief is bounded within two per cent."""
    rng = np.random.default_rng(seed)
    grid = SimpleNamespace(spacing_m=(10.0, 10.0), rows=257, cols=257, range_m=(0.0, 1.0))
    eye = rng.uniform(-2000, 5000, 2)
    camera = Camera((*eye, 5000.0), (1280.0, 1280.0, 0.0), 40.0)
    asked = np.zeros(1, ASK)
    asked["posts"] = [128, 128, 129, 129]
    asked["error_m"] = 1e-3
    (bound,), _, (inside,) = projection(asked, grid, camera, (1280, 720), 1.0)
    (px,), _ = screen_shift_px(camera, (1280, 720), np.array([[1285.0, 1275.0, 0.0]]), np.array([1e-3]), 1.0)
    assert inside
    stretch = np.hypot(*(eye - 1280)) / np.hypot(np.hypot(*(eye - 1280)), 5000)  # small ones are bounded less closely
    assert px <= bound <= px * (1.02 + 0.02 / stretch)


def boxes_of(asked, grid):
    """World corners (3, n) of the given boxes of posts."""
    (east, north), (x0, y0, x1, y1) = grid.spacing_m, asked["posts"].T
    low, high = asked["range_m"].astype("f8").T
    return np.stack([x0 * east, (grid.rows - 1 - y1) * north, low]), np.stack(
        [x1 * east, (grid.rows - 1 - y0) * north, high]
    )


def bounds_of(asked, grid, camera, size, near_m):
    """The reference's projections and bounds in pixels."""
    view, error_m = view_of(camera, size, near_m), asked["error_m"].astype("f8")
    p = reference.project_boxes(view, *boxes_of(asked, grid))
    return p, reference.error_px(view, p, error_m, error_m)


@settings(max_examples=100)
@given(st.integers(0, 10**6))
def test_bound_of_the_reference_holds_for_every_point_and_the_gpus_is_no_lower(ctx, projection, seed):
    rng = np.random.default_rng(seed)
    grid, camera, size, near_m = random_view(rng)
    asked = random_boxes(rng, grid, camera)
    p, bound_px = bounds_of(asked, grid, camera, size, near_m)
    points = random_posts(rng, grid, asked)
    rise = asked["error_m"].astype("f8")[:, None] * rng.choice([-1, 1], points.shape[:2])
    px, seen = screen_shift_px(camera, size, points.reshape(-1, 3), rise.ravel(), near_m)
    worst = np.where(seen, px, 0.0).reshape(rise.shape).max(1)
    assert (worst <= bound_px * (1 + 1e-9)).all()
    assert not (p.outside & seen.reshape(rise.shape).any(1)).any()
    gpu_px, outside, inside = projection(asked, grid, camera, size, near_m)
    assert not (outside & ~p.outside).any() and not (inside & ~p.inside).any()
    finite = gpu_px < np.float32(INFINITE_PX)
    assert (bound_px[finite & ~p.outside] <= gpu_px[finite & ~p.outside]).all()


@pytest.mark.parametrize("view", ["default", "grazing", "down", "wide", "pit", "outside", "corner"])
def test_bound_of_the_gpu_is_little_above_the_references(ctx, projection, view):
    """Within float32's slack: 0.05 % of the bound, and a millionth of the coordinates."""
    grid = MAPS["odd"]()
    camera, size, near_m = cameras(grid)[view], (640, 360), 0.1 * min(grid.spacing_m)
    level, rng = np.arange(7).repeat(40), np.random.default_rng(5)
    asked = np.zeros(len(level), ASK)
    at = rng.integers(0, [grid.cols - 1, grid.rows - 1], (len(level), 2)) >> level[:, None] << level[:, None]
    asked["posts"][:, :2], asked["posts"][:, 2:] = (
        at,
        np.minimum(at + (1 << level[:, None]), [grid.cols - 1, grid.rows - 1]),
    )
    asked["range_m"], asked["error_m"] = grid.range_m, 0.01
    p, bound_px = bounds_of(asked, grid, camera, size, near_m)
    gpu_px, outside, inside = projection(asked, grid, camera, size, near_m)
    assert (outside == p.outside).all() and (inside == p.inside).all()
    clear = ~p.outside & np.isfinite(bound_px) & (p.nearest_m > 2 * near_m)
    assert clear.any() and (gpu_px[clear] <= bound_px[clear] * 1.002).all()


def test_shift_of_a_point_is_the_cameras(ctx):
    grid = MAPS["odd"]()
    rng = np.random.default_rng(1)
    for camera in cameras(grid).values():
        points = rng.uniform(0, 1, (500, 3)) * [*grid.extent_m, grid.range_m[1]]
        rise = rng.normal(size=500)
        px, seen = screen_shift_px(camera, (320, 180), points, rise, 0.5)
        scale = reference.screen_scale(view_of(camera, (320, 180), 0.5), points.T)
        assert (scale.seen == seen).all()
        assert reference.shift_px(scale, rise)[seen] == pytest.approx(px[seen], rel=1e-12)


def test_a_post_counts_as_often_as_it_is_pixels_across():
    """Seen from z metres above a plain, a post covers K s_x / z times K s_y / z pixels."""
    heights = np.zeros((9, 9))
    for high, pixels in ((100.0, 4 * 360**2 * 3 / 100**2), (2000.0, 4 * 360**2 * 3 / 2000**2)):
        camera = Camera((2, 8, high), (2, 8, 0), 60.0)  # K = 360 / tan 30°
        weights = reference.post_weights(heights, (1.0, 4.0), view_of(camera, (1280, 720), 0.1))
        assert weights == pytest.approx(max(1.0, math.sqrt(pixels)))
