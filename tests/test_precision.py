"""The error of float32: gl_Position of every drawn vertex, compared with float64 and a derived bound."""

from dataclasses import replace

import moderngl
import numpy as np
import pytest
from maps import MAPS, SIZE, Scene, cameras, random_map, rough

from terrain_gl import Renderer
from terrain_gl.camera import Camera, clip_from_eye
from terrain_gl.camera.camera import depth_span_m
from terrain_gl.camera.rounding import CLIP_ROUNDINGS, certified_rounding_px, mesh_rounding_px, rounding_px
from terrain_gl.gpu.calls import calls
from terrain_gl.gpu.textures import depth_texture
from terrain_gl.heightmap import Heightmap
from terrain_gl.lod import EveryPost, Goal
from terrain_gl.mesh import MeshDraws, captured_triangles, vertex_heights
from terrain_gl.shade.picture import UNLIT
from terrain_gl.verify.holes import count_holes

DRAWN = np.dtype([("post", "2f4"), ("clip", "4f4")])
VARYINGS = ("v_post", "gl_Position")
ROUNDED = MeshDraws("PICTURE", varyings=VARYINGS)  # compiled once for each scene
AS_COMPUTED = MeshDraws("PICTURE", {"AS_COMPUTED": 1}, varyings=VARYINGS)


def drawn_vertices(scene, camera, tolerance_px=2.0, metric="max", draws=ROUNDED):
    """Posts, (n, 2), and clip coordinates, (n, 4), as the picture's own shaders compute them.

    With AS_COMPUTED, they are not rounded to 1/256 of a pixel.
    """
    selection = scene.select(camera, tolerance_px, metric)
    data = np.frombuffer(draws.of(selection.surface).capture(selection, DRAWN.itemsize), DRAWN)
    return data["post"].astype(float), data["clip"]


def places(heightmap, filled, posts):
    """World metres of vertices, in float64."""
    east, north = heightmap.spacing_m
    heights = vertex_heights(filled, posts).astype(np.float64)
    return np.stack([posts[:, 0] * east, (heightmap.rows - 1 - posts[:, 1]) * north, heights], -1)


def viewport(scene):
    """Width and height of the viewport to which the clip coordinates of drawn vertices belong."""
    return scene.levels.view.viewport[2:]


def pixels(clip, size):
    """(n, 2) pixels of clip coordinates, in float64."""
    return clip[:, :2].astype(np.float64) / clip[:, 3:].astype(np.float64) * np.divide(size, 2)


def shares(scene, camera, size=SIZE):
    """How much of the bound each vertex in the picture uses, and how many pixels."""
    posts, clip = drawn_vertices(scene, camera, draws=AS_COMPUTED)
    whole = (posts == np.floor(posts)).all(1)  # heights at the middles of cells are rounded as well
    posts, clip = posts[whole], clip[whole]
    points = places(scene.heightmap, scene.terrain.filled, posts)
    near_m = scene.near_m
    exact = np.c_[points - np.asarray(camera.eye), np.ones(len(points))] @ clip_from_eye(camera, size, near_m).T
    seen = (np.abs(exact[:, :2]) <= exact[:, 3:]).all(1) & (exact[:, 3] >= near_m)
    off = np.linalg.norm(pixels(clip[seen], viewport(scene)) - pixels(exact[seen], size), axis=1)
    return off / vertex_px(camera, size, scene.heightmap, points[seen]), off


def vertex_px(camera, size, heightmap, points):
    """The bound of vertices in the picture, at world metres."""
    from_eye = points - np.asarray(camera.eye)
    away = np.linalg.norm(from_eye, axis=1)
    return rounding_px(camera, size, heightmap.spacing_m, away, from_eye @ camera.axes[2])


@pytest.mark.parametrize("name", MAPS)
def test_float32_keeps_to_the_bound(ctx, name):
    scene = Scene.of(ctx, MAPS[name]())
    used = []
    for view, camera in cameras(scene.heightmap).items():
        share, off = shares(scene, camera)
        assert not len(share) or share.max() <= 1, (view, share.max(), off.max())
        used.append(share.max(initial=0.0))
    scene.release()
    assert max(used) > 0.001, "nothing was compared"
    print(f"\n{name}: at most {max(used):.3f} of the bound")


def test_the_bound_does_not_grow_with_the_map(ctx):
    """A map far from 0 in all coordinates: heights of 8848 m, an eye 100,000 posts from the corner."""
    heights = 8848 + MAPS["odd"]().heights
    scene = Scene.of(ctx, Heightmap(heights, 30.0))
    middle = np.divide(scene.heightmap.extent_m, 2)
    for away in (100.0, 3e6):
        camera = Camera((middle[0] - away, middle[1], 9000.0), (*middle, 8850.0), 45.0 if away < 1e3 else 0.2)
        share, off = shares(scene, camera)
        assert len(share) > 10 and share.max() <= 1


@pytest.mark.parametrize("fov", [0.1, 1.0, 45.0, 170.0])
def test_measure_bounds_what_float32_adds(ctx, fov):
    """The bound of the mesh is that of its vertices, or more; in narrow views, the certificate includes it."""
    size, heightmap = (3840, 2160), Heightmap(rough(65, 65, 5, 300.0), 30.0)
    middle = np.array([*np.divide(heightmap.extent_m, 2), 150.0])
    away = {0.1: 1e6, 1.0: 1e5}.get(fov, 1500.0)
    camera = Camera(tuple(middle + away * np.array([0.48, -0.64, 0.6])), tuple(middle), fov)
    scene = Scene.of(ctx, heightmap, size)
    share, off = shares(scene, camera, size)
    selection = scene.select(camera, 2.0)
    bound = mesh_rounding_px(captured_triangles(selection), heightmap, scene.terrain.base_m, camera, size, scene.near_m)
    print(f"\n{fov} degrees: {len(off)} vertices, off by {off.max():.3g} px, at most {bound:.3g}")
    assert len(off) > 10 and off.max() <= (off[off > 0] / share[off > 0]).max() <= bound
    assert fov > 1.0 or bound < selection.certified_px
    assert fov > 0.1 or 0.5 < bound < 1.0


FAR = np.array([48e4, -64e4, 60e4])  # metres from the map to the eye, 10⁶ together


def narrow_camera(kind, middle):
    """A camera whose picture is a tenth of a degree high, or as small: 1,745 m at the distance `FAR`."""
    eye, k = middle + FAR, 1.2e6
    if kind == "parallel":
        return Camera.orthographic(tuple(eye), tuple(middle), 1745.0)
    level = Camera(tuple(eye), tuple(middle), 0.1)
    if kind == "rolled":
        return replace(level, up=(1.0, 2.0, 3.0))
    if kind == "lens":
        turn = level.axes * [[1.0], [-1.0], [1.0]]
        intrinsics = np.array([[k, 0, 1100], [0, 0.9 * k, 1500], [0, 0, 1]])
        return Camera.from_opencv(intrinsics, turn, -turn @ eye, (3840, 2160))
    return replace(level, bend_per_m=1e-9) if kind == "curved" else level


def test_parallel_rays_see_land_that_an_edit_has_raised_beyond_the_units(ctx):
    """What float32 adds depends on the heights that there are, not on those that gave the tables their units."""
    size, camera = (640, 360), Camera.orthographic((480.0, -500.0, 1.0), (480.0, 480.0, 1.0), 0.1)
    with Renderer(Heightmap(rough(33, 33, 5, 2.0), 30.0), size, ctx=ctx) as renderer:
        renderer.edit(3, 4, 50.0)
        edited = renderer.heightmap
        opened_anew = Heightmap(edited.heights, 30.0)
        assert edited.quantised_m != opened_anew.quantised_m
        bounds = [certified_rounding_px(camera, each, size) for each in (edited, opened_anew)]
    assert bounds[0][1] > 0 and bounds[0] == bounds[1]


@pytest.mark.parametrize(
    ("kind", "goal"),
    [
        ("level", Goal(0.05)),
        ("rolled", Goal(0.02)),
        ("lens", Goal(0.02, "rms")),
        ("curved", Goal(0.03)),
        ("parallel", Goal(0.02)),
        ("level", Goal(metric="max", triangles=60000)),
        ("level", Goal(metric="rms", triangles=60000)),
        ("rolled", "every post"),
    ],
)
def test_in_narrow_views_the_certificate_holds_for_vertices_on_the_screen(ctx, monkeypatch, kind, goal):
    """Each is certified, and what float32 adds to a vertex; without this term, it is more than the certificate."""
    size, heightmap = (3840, 2160), Heightmap(rough(33, 33, 5, 2.0), 30.0)
    camera = narrow_camera(kind, np.array([*np.divide(heightmap.extent_m, 2), 1.0]))
    for term in (certified_rounding_px, lambda *_: (0.0,) * 4):
        monkeypatch.setattr("terrain_gl.camera.view.certified_rounding_px", term)
        scene = Scene.of(ctx, heightmap, size)
        levels = EveryPost(scene.tables, scene.levels.view) if goal == "every post" else scene.levels
        selection = levels.select(camera, size, scene.near_m, Goal() if levels is not scene.levels else goal)
        data = ROUNDED.of(selection.surface).capture(selection, DRAWN.itemsize)
        posts, clip = (np.frombuffer(data, DRAWN)[name] for name in DRAWN.names)
        points = camera.lowered(places(heightmap, scene.terrain.filled, posts.astype(float)))
        whole = (posts == np.floor(posts)).all(1)  # the truth of others is rounded, too
        span_m = depth_span_m(camera, heightmap)
        exact = np.c_[points - camera.eye, np.ones(len(points))] @ clip_from_eye(camera, size, scene.near_m, span_m).T
        seen = whole & (np.abs(exact[:, :2]) <= exact[:, 3:]).all(1)
        off = np.linalg.norm(pixels(clip[seen], viewport(scene)) - pixels(exact[seen], size), axis=1)
        assert seen.sum() > 300
        certified_px = selection.farthest_px or selection.certified_px
        assert (off.max() <= certified_px) == (term is certified_rounding_px), (off.max(), certified_px)
        if levels is scene.levels and not goal.triangles:  # half of the tolerance is left to the mesh
            assert term is not certified_rounding_px or certified_px < goal.tolerance_px / 2 + 1.5
        scene.release()


def test_ordinary_views_have_the_meshes_and_certificates_that_they_had(ctx):
    """There, nothing is included: land far from the eye is off by less than `LEFT_OUT_PX`."""
    heightmap = MAPS["odd"]()
    for size, fovs in (((1280, 720), (3.0, 45.0, 60.0, 170.0)), ((3840, 2160), (10.0, 60.0, 120.0))):
        for fov in fovs:
            camera = replace(cameras(heightmap)["default"], fov_deg=fov)
            assert not any(certified_rounding_px(camera, heightmap, size)), (size, fov)
    assert all(certified_rounding_px(replace(camera, fov_deg=1.0), heightmap, size)[:2])


def test_a_finer_mesh_is_drawn_where_float32_takes_a_part_of_the_tolerance(ctx, monkeypatch):
    """The whole is within the tolerance, if float32 takes less than a half of it."""
    heightmap = Heightmap(rough(65, 65, 5, 300.0), 30.0)
    middle = np.array([*np.divide(heightmap.extent_m, 2), 150.0])
    camera = Camera(tuple(middle + FAR / 3), tuple(middle), 0.3)
    triangles = []
    for term in (certified_rounding_px, lambda *_: (0.0,) * 4):
        monkeypatch.setattr("terrain_gl.camera.view.certified_rounding_px", term)
        scene = Scene.of(ctx, heightmap, (3840, 2160))
        selection = scene.select(camera, 1.0)
        assert 0.9 < selection.certified_px <= 1.0
        triangles.append(selection.triangles)
        scene.release()
    assert triangles[0] > 1.1 * triangles[1]


def test_the_test_would_see_a_worse_vertex(ctx):
    """Without the mechanism, with float32 positions from the map's corner, the bound does not hold."""
    scene = Scene.of(ctx, MAPS["offset"]())  # at 8848 m
    heightmap = scene.heightmap
    camera = cameras(heightmap)["grazing"]
    points = places(heightmap, scene.terrain.filled, drawn_vertices(scene, camera)[0])
    near_m = scene.near_m
    matrix = clip_from_eye(camera, SIZE, near_m)
    exact = np.c_[points - np.asarray(camera.eye), np.ones(len(points))] @ matrix.T
    whole = matrix.copy()
    whole[:, 3] -= matrix[:, :3] @ np.asarray(camera.eye)
    naive = np.c_[points, np.ones(len(points))].astype("f4") @ whole.astype("f4").T
    seen = (np.abs(exact[:, :2]) <= exact[:, 3:]).all(1) & (exact[:, 3] >= near_m) & (naive[:, 3] > 0)
    off = np.linalg.norm(pixels(naive[seen], SIZE) - pixels(exact[seen], SIZE), axis=1)
    assert (off > vertex_px(camera, SIZE, heightmap, points[seen])).any()


def test_the_number_of_roundings_is_that_of_the_shader():
    """numpy's float32 with the operations of glsl/blocks/view.glsl never rounds more often than the bound counts."""
    rng = np.random.default_rng(4)
    n, u = 20000, 2.0**-24
    steps = rng.integers(-3000, 3000, (n, 2)).astype("f8")
    spacing, offset = rng.uniform(0.1, 40, (n, 2)), rng.uniform(-0.5, 0.5, (n, 2))
    row = rng.uniform(-1, 1, (n, 3))
    up = rng.uniform(-900, 900, n).astype("f4").astype("f8")
    exact = np.c_[steps * spacing - offset * spacing, up]
    f4 = np.float32
    flat = steps.astype(f4) * spacing.astype(f4) - (offset * spacing).astype(f4)
    v, m = np.c_[flat, up.astype(f4)], row.astype(f4)
    clip = (m[:, 0] * v[:, 0] + m[:, 1] * v[:, 1]) + m[:, 2] * v[:, 2]
    most = (np.abs(row) * (np.abs(exact) + np.c_[spacing, np.zeros(n)])).sum(1)
    used = np.abs(clip - (row * exact).sum(1)) / (u * most)
    assert 1 < used.max() <= CLIP_ROUNDINGS


# --- Slivers ----------------------------------------------------------------------------------------------------------


def covered(ctx, clip, size, viewport):
    """Pixels whose samples are covered, without and with a depth test: two arrays (height, width), first row on top.

    With it, a sample is not covered if the depth of its fragment is below the empty buffer's.
    """
    program = ctx.program(
        "#version 430\nin vec4 p; void main() { gl_Position = p; }",
        "#version 430\nout vec4 c; void main() { c = vec4(1.0); }",
    )
    colours, seen, depths = ctx.texture(size, 4, samples=4), ctx.texture(size, 4), depth_texture(ctx, size, 4)
    many, flat, one = ctx.framebuffer([colours], depths), ctx.framebuffer([colours]), ctx.framebuffer([seen])
    buffer = ctx.buffer(clip.astype("f4").tobytes())
    vao = ctx.vertex_array(program, [(buffer, "4f", "p")])
    calls(ctx).ClipControl(0x8CA1, 0x935F)  # lower left, 0 to 1
    ctx.enable_only(moderngl.DEPTH_TEST)
    ctx.depth_func = ">="
    pictures = []
    for target in (flat, many):
        target.clear(depth=0.0)
        target.viewport = viewport
        target.use()
        vao.render(moderngl.TRIANGLES)
        ctx.copy_framebuffer(one, flat)
        pictures.append(np.frombuffer(seen.read(), "u1").reshape(size[1], size[0], 4)[::-1, :, 0] == 255)
    ctx.detect_framebuffer(0).use()  # moderngl must not use a framebuffer that is released
    for part in (vao, buffer, program, many, flat, one, colours, seen, depths):
        part.release()
    return pictures


def test_vertices_are_rounded_as_the_rasteriser_rounds_them(ctx):
    """They are on its grid, and half a step of it away along each axis at most."""
    heightmap = MAPS["odd"]()
    scene, camera = Scene.of(ctx, heightmap, SIZE), cameras(heightmap)["default"]
    exact, rounded = (
        pixels(drawn_vertices(scene, camera, draws=draws)[1], viewport(scene)) * 256 for draws in (AS_COMPUTED, ROUNDED)
    )
    seen = (np.abs(exact) <= 128 * np.array(SIZE)).all(1)
    assert np.abs(rounded - np.round(rounded))[seen].max() < 0.05
    assert 0.4 < np.abs(rounded - exact)[seen].max() <= 0.55


@pytest.mark.parametrize("is_rounded", [True, False])
def test_between_slivers_no_depth_is_lost(ctx, is_rounded):
    """A triangle that is seen edge-on covers a sample, but without our rounding its depth may be below 0.

    The rasteriser rounds corners to 1/256 of a pixel, and some compute depth from the corners before rounding.
    """
    size, draws = (1280, 720), ROUNDED if is_rounded else AS_COMPUTED
    heightmap = MAPS["checkerboard"]()
    scene, camera = Scene.of(ctx, heightmap, size), cameras(heightmap, size)["wide"]
    clip = drawn_vertices(scene, camera, 1.0, "rms", draws)[1]

    without, tested = covered(ctx, clip, size, scene.levels.view.viewport)
    assert 0.3 < without.mean() < 0.9
    view = heightmap, camera, size, scene.near_m, 2.0
    assert count_holes(without, *view) == 0
    assert count_holes(tested, *view) <= (0 if is_rounded else 1)  # 1 with Mesa 22


def lost_samples(ctx, seed, view):
    """Holes in the picture of one random map, which are samples of sky between slivers."""
    camera, tolerance_px, metric = view
    with Renderer(random_map(np.random.default_rng(seed)), (640, 360), ctx=ctx) as renderer:
        renderer.draw(camera, tolerance_px, metric=metric, style=UNLIT)
        return renderer.measure()["holes"]


def test_slivers_across_the_rim_of_the_picture_lose_no_sample(ctx):
    """A rasteriser may cut them at the rim of the viewport, so the viewport has a margin around the picture."""
    eye, target = (1172.8396949, 16.0457859, 2077.2220120), (5432.7511685, 38.6395980, -694.3599687)
    view = Camera(eye, target, 3.25839260645865), 0.0566, "rms"
    assert lost_samples(ctx, [2007, 4], view) == 0
    x, y, width, height = viewport_of(ctx)
    assert x < 0 and y < 0 and x + width > 640 and y + height > 360


def viewport_of(ctx):
    """The viewport of a picture of 640 x 360 pixels."""
    with Renderer(Heightmap(np.zeros((9, 9), "f4"), 10.0), (640, 360), ctx=ctx) as renderer:
        renderer.draw(Camera.default(renderer.heightmap), 1.0, style=UNLIT)
        return renderer.resources.view.viewport


def test_slivers_across_the_near_plane_lose_no_sample(ctx):
    """The depth between their corners may be computed as less than 0, and is clamped."""
    eye, target = (6737.229889827, 6.642529635, 0.136080563), (3070.834647935, 0.913289311, 291.211656712)
    view = Camera(eye, target, 9.707728083658697, (0.79611278, -2.67033928, -1.00287122)), 0.767597, "max"
    assert lost_samples(ctx, [4010, 1], view) == 0


def test_an_eye_in_the_plane_of_flat_land_sees_none_of_it(ctx):
    """Clamped depths end OpenGL's cut at the near plane. Without gl_ClipDistance, a third of the picture is land."""
    with Renderer(Heightmap(np.zeros((65, 65), "f4"), 10.0), (320, 180), ctx=ctx) as renderer:
        renderer.draw(Camera((325, 325, 0), (600, 320, -50), 60.0), 1.0, style=UNLIT)
        assert (renderer.picture.sky_share() == 1).all()
