"""Cameras with a lens: calibrated ones, those of two matrices, orthographic ones. Each is certified and checked."""

import itertools
import math

import numpy as np
import pytest
from asking import ask
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import MAPS, Scene, rough

from terrain_gl import Camera, Heightmap, Renderer, UsageError, reference
from terrain_gl.camera import boxes_in_picture, clip_from_eye, screen_shift_px
from terrain_gl.camera.camera import depth_span_m
from terrain_gl.camera.pieces import Piece
from terrain_gl.camera.view import ViewBlock
from terrain_gl.comparison.pruned import view_of
from terrain_gl.film.path import CameraPath, Keyframe
from terrain_gl.heightmap import ground_m
from terrain_gl.viewer.pose import Pose

SIZE = (320, 180)


def random_rotation(rng):
    """Rows right, down, forward."""
    q = rng.normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def looking(eye, target):
    """Rows right, down, forward of a level camera."""
    forward = np.subtract(target, eye) / math.dist(eye, target)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def intrinsics(fx, fy, cx, cy):
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def opencv_pixels(k, turn, t, points):
    """OpenCV's pinhole formula without distortion: columns and rows; the middle of the first pixel is (0, 0)."""
    x, y, z = turn @ points.T + np.asarray(t)[:, None]
    return np.stack([k[0, 0] * x / z + k[0, 2], k[1, 1] * y / z + k[1, 2]], -1), z


def cameras_over(heightmap, rng, size=SIZE):
    """A camera of each kind that sees a map."""
    east, north = heightmap.extent_m
    low, high = heightmap.range_m
    target = rng.uniform(0.2, 0.8, 2) * [east, north]
    away = rng.normal(size=2)
    away *= rng.uniform(0.2, 1.2) * max(east, north) / np.linalg.norm(away)
    eye = np.array([*target + away, high + rng.uniform(0.05, 0.5) * max(east, north)])
    target = np.array([*target, 0.5 * (low + high)])
    turn = looking(eye, target)
    wide, tall = size
    k = intrinsics(*(rng.uniform(0.6, 2.0, 2) * wide), rng.uniform(-0.2, 1.2) * wide, rng.uniform(-0.2, 1.2) * tall)
    yield Camera.from_opencv(k, turn, -turn @ eye, size)
    yield Camera.orthographic(eye, target, rng.uniform(0.1, 0.8) * max(east, north), aspect=rng.uniform(1.0, 3.0))
    left, right = np.sort(rng.uniform(-1, 1, 2)) + [-0.1, 0.1]
    bottom, top = np.sort(rng.uniform(-1, 1, 2)) + [-0.1, 0.1]
    gl = turn * [[1.0], [-1.0], [-1.0]]
    yield Camera.from_matrices(view_matrix(gl, eye), frustum(left, right, bottom, top))


def view_matrix(turn, eye):
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    matrix[:3, 3] = -turn @ eye
    return matrix


def frustum(left, right, bottom, top, near=0.5, far=1e5):
    """glFrustum, of edges at the distance 1."""
    return np.array(
        [
            [2 / (right - left), 0, (right + left) / (right - left), 0],
            [0, 2 / (top - bottom), (top + bottom) / (top - bottom), 0],
            [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
            [0, 0, -1, 0],
        ]
    )


def ortho(left, right, bottom, top, near=-1e4, far=1e5):
    """glOrtho."""
    return np.array(
        [
            [2 / (right - left), 0, 0, -(right + left) / (right - left)],
            [0, 2 / (top - bottom), 0, -(top + bottom) / (top - bottom)],
            [0, 0, -2 / (far - near), -(far + near) / (far - near)],
            [0, 0, 0, 1],
        ]
    )


def test_posts_are_where_opencvs_formula_says():
    """2,000 cameras, 50 posts each, to a millionth of a pixel, where the formula itself is not worse conditioned."""
    rng = np.random.default_rng(0)
    worst = 0.0
    for _ in range(2000):
        size = tuple(rng.integers(16, 4000, 2).tolist())
        k = intrinsics(*np.exp(rng.uniform(3, 9, 2)), *(rng.uniform(-1, 2, 2) * size))
        turn = random_rotation(rng)
        eye = rng.normal(size=3) * 10.0 ** rng.uniform(0, 6)
        t = -turn @ eye
        camera = Camera.from_opencv(k, turn, t, size)
        points = eye + rng.uniform(0.3, 1, (50, 1)) * (np.c_[rng.normal(0, 0.4, (50, 2)), np.ones(50)] @ turn) * 2000
        there, z = opencv_pixels(k, turn, t, points)
        assert (z > 0).all()
        # t and R X are as large as the eye's coordinates, which float64 rounds: so many pixels at this depth
        rounding = 16 * np.spacing(np.abs(eye).max()) * k.max() / z.min() + np.spacing(np.abs(there).max()) * 16
        off = np.abs(camera.pixels(points, size) - there).max()
        assert off <= 1e-6 + rounding and rounding < 1e-4
        worst = max(worst, off)
        clip = clip_from_eye(camera, size, 1.0) @ np.c_[points - np.array(camera.eye), np.ones(50)].T
        drawn = 0.5 * np.array(size)[:, None] * (1 + clip[:2] / clip[3] * [[1], [-1]]) - 0.5
        assert np.abs(drawn.T - there).max() <= 1e-6 + rounding
    assert worst < 1e-4


@pytest.mark.parametrize("kind", [frustum, ortho])
def test_posts_are_where_two_matrices_put_them(kind):
    rng = np.random.default_rng(1)
    for _ in range(300):
        scale = 1.0 if kind is frustum else 500.0
        edges = (np.sort(rng.uniform(-1, 1, 2)) + [-0.05, 0.05]) * scale
        sides = (np.sort(rng.uniform(-1, 1, 2)) + [-0.05, 0.05]) * scale
        turn, eye = random_rotation(rng), rng.normal(0, 1000, 3)
        view, projection = view_matrix(turn, eye), kind(*edges, *sides)
        camera = Camera.from_matrices(view, 3.7 * projection)  # a factor of a projection changes nothing
        points = eye + rng.uniform(100, 3000, (40, 1)) * (np.c_[rng.normal(0, 0.5, (40, 2)), -np.ones(40)] @ turn)
        clip = projection @ view @ np.c_[points, np.ones(40)].T
        there = 0.5 * np.array(SIZE)[:, None] * (1 + clip[:2] / clip[3] * [[1], [-1]]) - 0.5
        np.testing.assert_allclose(camera.pixels(points, SIZE), there.T, atol=1e-6)
        ours = clip_from_eye(camera, SIZE, 1.0, 9000.0) @ np.c_[points - np.array(camera.eye), np.ones(40)].T
        np.testing.assert_allclose(ours[:2] / ours[3], clip[:2] / clip[3], atol=1e-7)


def test_a_symmetric_lens_is_the_ordinary_camera():
    plain = Camera((10, 20, 300), (400, 900, 50), 50)
    f = plain.focal_px(SIZE[1])
    turn = plain.axes * [[1.0], [-1.0], [1.0]]
    k = intrinsics(f, f, 0.5 * SIZE[0] - 0.5, 0.5 * SIZE[1] - 0.5)
    lens = Camera.from_opencv(k, turn, -turn @ np.array(plain.eye), SIZE)
    assert lens.centre == pytest.approx((0, 0), abs=1e-15) and lens.aspect(SIZE) == 1.0
    assert lens.half_extent(SIZE) == pytest.approx(plain.half_extent(SIZE), rel=1e-14)
    assert lens.fov_deg == pytest.approx(50) and lens.eye == pytest.approx(plain.eye)
    np.testing.assert_allclose(lens.axes, plain.axes, atol=1e-15)


def moved_px(camera, points, rise_m, size):
    """Pixels between points and the same points raised: from where both are in the picture."""
    return np.linalg.norm(
        camera.pixels(points + np.c_[0 * points[:, :2], rise_m], size) - camera.pixels(points, size), axis=1
    )


def test_a_view_follows_each_thing_that_it_depends_on(ctx):
    """The block is not written again for the same view; each change makes the block that a new view has."""
    scene, wide = (Scene.of(ctx, Heightmap(rough(40, 60), spacing_m)) for spacing_m in (30.0, 40.0))
    over = Camera.default(scene.terrain.heightmap)
    above = Camera.orthographic(over.eye, over.target, 500.0)
    asked = {"terrain": scene.terrain, "camera": above, "size": SIZE, "near_m": 1.0, "metric": 0, "tolerance_px": 1.0}
    changes = {"camera": over, "size": (90, 160), "near_m": 2.0, "metric": 1, "tolerance_px": 2.0}

    def written(view, asked):
        view.write(**asked)
        return view.block.read()

    view = ViewBlock(ctx)
    first = written(view, asked)
    for changed in [*({name: value} for name, value in changes.items()), {"terrain": wide.terrain}]:
        fresh = written(ViewBlock(ctx), asked | changed)
        assert written(view, asked | changed) == fresh
        assert changed.keys() == {"near_m"} or fresh != first
        assert written(view, asked) == first
    view.crop(Piece((0, 0), (100, 50), SIZE))
    assert view.block.read() != first == written(view, asked)
    scene.terrain.heightmap.range_m = -1e3, 1e3  # as after an edit: the depths of parallel rays end lower
    assert written(view, asked) == written(ViewBlock(ctx), asked) != first


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6))
def test_the_bound_of_a_box_holds(ctx, seed):
    """Points of the box in the picture move no further than the reference's bound; the shader's is no lower."""
    rng = np.random.default_rng(seed)
    heightmap = Heightmap(rough(40, 60, seed % 7, 800.0), (30.0, 20.0))
    scene = Scene.of(ctx, heightmap)
    view = ViewBlock(ctx)
    near_m = 2.0
    for camera in cameras_over(heightmap, rng):
        n = 40
        first = rng.integers(0, [50, 30], (n, 2))
        side = 2 ** rng.integers(0, 4, (n, 1))
        last = np.minimum(first + side, [59, 39])
        heights = np.sort(rng.uniform(*heightmap.range_m, (n, 2)), 1).astype("f4").astype("f8")
        error = 10.0 ** rng.uniform(-3, 1.5, n).astype("f4").astype("f8")
        low = np.stack([first[:, 0] * 30.0, (39 - last[:, 1]) * 20.0, heights[:, 0]])
        high = np.stack([last[:, 0] * 30.0, (39 - first[:, 1]) * 20.0, heights[:, 1]])
        pinhole = view_of(camera, SIZE, near_m)
        p = reference.project_boxes(pinhole, low, high)
        bound = reference.error_px(pinhole, p, error, error)
        for _ in range(20):
            points = (low + rng.choice([0, 1, 0.5], (3, n)) * (high - low)).T
            rise = error * rng.choice([-1, 1, 0.3], n)
            px, seen = screen_shift_px(camera, SIZE, points, rise, near_m)
            assert not (p.outside & seen).any() and (px[seen] <= bound[seen] * (1 + 1e-9)).all()
            there = seen & np.isfinite(px) & (px < 1e3)
            np.testing.assert_allclose(px[there], moved_px(camera, points, rise, SIZE)[there], rtol=1e-6, atol=1e-6)
            assert not (seen & ~boxes_in_picture(camera, SIZE, near_m, low.T, high.T)).any()
        near = 0.0 if camera.is_orthographic else near_m
        view.write(scene.terrain, camera, SIZE, near)
        told = ask(
            ctx,
            "lod/project.glsl",
            "Projection p = project(box_of(ivec2(a.xy), ivec2(a.zw), b.xy), 1.0);"
            "return vec4(error_px(p, b.z, b.z), float(p.outside), float(p.inside), 0.0);",
            np.c_[first, last],
            np.c_[heights - scene.terrain.base_m, error, error],
            resources={**scene.terrain.resources, **view.resources},
        )
        outside, inside = told[:, 1] > 0, told[:, 2] > 0
        pinhole = pinhole._replace(near_m=near)
        p = reference.project_boxes(pinhole, low, high)
        bound = reference.error_px(pinhole, p, error, error)
        assert not (outside & ~p.outside).any() and not (inside & ~p.inside).any()
        drawn = ~p.outside & (told[:, 0] < 9e29)
        assert (bound[drawn] <= told[drawn, 0] * (1 + 1e-6)).all()
        clear = drawn & ~outside & (p.nearest_m > 2 * near) & (bound > 1e-3)
        assert (told[clear, 0] <= bound[clear] * 1.01).all(), "the bound is as tight as that of ordinary cameras"
    view.release()
    scene.release()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["odd", "cliff", "holes", "spike"])
def test_achieved_is_at_most_certified_and_that_at_most_asked(name):
    rng = np.random.default_rng(len(name))
    heightmap = MAPS[name]()
    largest = 0.0
    with Renderer(heightmap, SIZE) as renderer:
        for _, asked in itertools.product(range(3), (1.0, 0.25)):
            for camera in cameras_over(heightmap, rng):
                renderer.draw(camera, asked, style="depth")
                stats = renderer.measure()
                assert stats["max_error_px"] <= stats["certified_max_error_px"] <= asked and stats["holes"] == 0
                largest = max(largest, stats["max_error_px"] / asked)
                budget = renderer.draw(camera, triangles=2000, style="depth")
                assert renderer.measure()["max_error_px"] <= budget["certified_max_error_px"]
    assert largest > 0.5, "the bound is not loose"


def test_hidden_land_changes_no_picture():
    heightmap = Heightmap(rough(200, 200, 2, 900.0), 20.0)
    rng = np.random.default_rng(8)
    hidden = 0
    with Renderer(heightmap, SIZE) as renderer:
        for _ in range(6):
            x, y = rng.uniform(0.3, 0.7, 2) * heightmap.extent_m
            eye = np.array([x, y, renderer.height_at(x, y) + 25.0])
            turn = looking(eye, eye + [*rng.normal(size=2), -0.05])
            k = intrinsics(260, 150, rng.uniform(0, SIZE[0]), rng.uniform(0, SIZE[1]))
            camera = Camera.from_opencv(k, turn, -turn @ eye, SIZE)
            frame = renderer.render(camera, 1.0, style="normals")
            hidden += frame.stats["patches_hidden"]
            assert (frame.image == renderer.render(camera, 1.0, style="normals", occlusion="off").image).all()
    assert hidden > 0


def test_pixels_see_the_land_that_a_ray_meets():
    """Depths in the picture against rays followed through the truth, one per pixel."""
    heightmap = Heightmap(rough(80, 80, 3, 900.0), 30.0)
    rng = np.random.default_rng(4)
    for camera in cameras_over(heightmap, rng):
        with Renderer(heightmap, SIZE) as renderer:
            depth = renderer.render(camera, 0.05, style="depth", exact=True).image[..., 0]
        (across, above), middle = camera.half_extent(SIZE), camera.centre
        row, col = (each.ravel() for each in np.mgrid[4 : SIZE[1] : 9, 5 : SIZE[0] : 9])
        x = middle[0] + (2 * (col + 0.5) / SIZE[0] - 1) * across
        y = middle[1] + (1 - 2 * (row + 0.5) / SIZE[1]) * above
        aside = np.outer(x, camera.axes[0]) + np.outer(y, camera.axes[1])
        start = np.array(camera.eye) + aside * camera.is_orthographic
        along = camera.axes[2] + aside * (not camera.is_orthographic)
        t = np.linspace(0, 8000, 8000)
        found = np.full(len(row), np.inf)
        for i in range(len(row)):
            points = start[i] + t[:, None] * along[i]
            above_m = points[:, 2] - ground_m(heightmap, points[:, :2])
            over = np.flatnonzero(np.isfinite(above_m))
            below = over[above_m[over] < 0]
            under_the_rim = len(over) and above_m[over[0]] < 0
            found[i] = np.nan if under_the_rim else t[below[0]] if len(below) else np.inf
        there = np.isfinite(found) & np.isfinite(depth[row, col])
        agree = (np.isfinite(found) == np.isfinite(depth[row, col]))[~np.isnan(found)]
        assert there.sum() > 20 and agree.mean() > 0.97
        off = np.abs(depth[row, col][there] - found[there]) / camera.w_at(found[there])
        assert np.median(off) < 2e-3 * (np.median(found[there]) if camera.is_orthographic else 1)


def test_what_a_lens_cannot_be():
    turn = np.eye(3)
    k = intrinsics(100, 100, 50, 50)
    bad = [
        (lambda: Camera.from_opencv(k, 1.01 * turn, [0, 0, 0], SIZE), "R: is no rotation"),
        (lambda: Camera.from_opencv(k, np.diag([1, 1, -1]), [0, 0, 0], SIZE), "mirrors"),
        (lambda: Camera.from_opencv(k + [[0, 3, 0], [0, 0, 0], [0, 0, 0]], turn, [0, 0, 0], SIZE), "skew"),
        (lambda: Camera.from_opencv(-k, turn, [0, 0, 0], SIZE), "fx and fy above 0"),
        (lambda: Camera.from_opencv(np.eye(4), turn, [0, 0, 0], SIZE), "3 x 3"),
        (lambda: Camera.from_opencv(k, turn, [0, np.nan, 0], SIZE), "t: expected"),
        (lambda: Camera.from_opencv(k, turn, [0, 0, 0], (0, 5)), "at least 1x1"),
        (lambda: Camera.from_matrices(np.eye(4), np.eye(4) * 2 + np.eye(4)[::-1]), "neither a perspective"),
        (lambda: Camera.from_matrices(2 * np.eye(4), frustum(-1, 1, -1, 1)), "last row"),
        (lambda: Camera.from_matrices(np.diag([2, 1, 1, 1.0]), frustum(-1, 1, -1, 1)), "view: is no rotation"),
        (lambda: Camera.orthographic((0, 0, 9), (0, 0, 0), 0.0), "height"),
        (lambda: Camera.orthographic((0, 0, 9), (0, 0, 0), 5.0, aspect=-1), "aspect"),
    ]
    for make, words in bad:
        with pytest.raises(UsageError, match=words) as found:
            make()
        assert "\n" not in str(found.value)


def test_what_a_lens_does_not_do():
    heightmap = Heightmap(rough(40, 40, 1, 300.0), 10.0)
    turn = looking((0, 0, 900), (200, 200, 0))
    calibrated = Camera.from_opencv(intrinsics(300, 280, 100, 90), turn, -turn @ [0, 0, 900.0], SIZE)
    parallel = Camera.orthographic((200, 100, 900), (200, 200, 0), 500.0)
    assert parallel == Camera.orthographic((200, 100, 900), (200, 200, 0), 500.0)
    with Renderer(heightmap, SIZE) as renderer:
        renderer.render(calibrated, size=(640, 360))
        for camera, options, words in [
            (calibrated, {"size": (320, 200)}, "another shape"),
            (parallel, {"near_m": 5.0}, "near"),
            (parallel, {"curvature": "on"}, "curvature"),
            (parallel, {"method": "clipmap", "triangles": 2000}, "orthographic"),
        ]:
            with pytest.raises(UsageError, match=words):
                renderer.render(camera, **options)
    with pytest.raises(UsageError, match="lens"):
        Pose.of(calibrated)
    with pytest.raises(UsageError, match="keyframe 2: .*lens"):
        CameraPath([Keyframe(Camera.default(heightmap)), Keyframe(parallel)])


def test_exaggerated_pictures_of_a_parallel_view_have_higher_relief():
    """Straight from the side, the relief is three times as high in pixels."""
    heightmap = Heightmap(10.0 + 50.0 * np.outer(np.hanning(41), np.hanning(41)), 10.0)
    camera = Camera.orthographic((200, -500, 50), (200, 200, 50), 400.0)
    with Renderer(heightmap, SIZE) as renderer:
        high = []
        for factor in (1.0, 3.0):
            image = renderer.render(camera, 0.2, style="normals", exaggeration=factor, surroundings="none").image
            land = (image[..., :3] != image[0, 0, :3]).any(-1)
            column = land[:, SIZE[0] // 2]
            high.append(column.sum())
            assert renderer.measure()["max_error_px"] <= 0.2
    assert high[0] > 10 and high[1] == pytest.approx(3 * high[0], abs=3)


def test_both_kinds_of_camera_take_turns(ctx):
    """Each has programs of its own, so what one renderer drew before changes nothing."""
    heightmap = MAPS["odd"]()
    middle = (*np.divide(heightmap.extent_m, 2), 0.0)
    eye = tuple(np.add(middle, (500.0, -3000.0, 2500.0)))
    views = Camera(eye, middle, 45.0), Camera.orthographic(eye, middle, 3000.0)
    pictures = []
    for order in (1, -1):
        with Renderer(heightmap, SIZE, ctx=ctx) as renderer:
            drawn = [renderer.render(view, 2.0, style="lambert").image for view in views[::order]][::order]
        pictures.append([each.tobytes() for each in drawn])
    assert pictures[0] == pictures[1] and len(set(pictures[0])) == 2


def test_depths_of_a_parallel_view_do_not_leave_their_range():
    heightmap = MAPS["odd"]()
    for camera in cameras_over(heightmap, np.random.default_rng(3)):
        span = depth_span_m(camera, heightmap)
        if not camera.is_orthographic:
            assert span == 0
            continue
        corners = np.array(list(itertools.product(*([0, e] for e in heightmap.extent_m), heightmap.range_m)))
        away = (corners - camera.eye) @ camera.axes[2]
        assert away.max() < span < 1.1 * away.max()
