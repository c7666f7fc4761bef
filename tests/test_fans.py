"""A patch of 2 × 2 segments over a node is a fan: its bound holds with any edges cut, and it decides meshes."""

import numpy as np
import pytest
from maps import cameras, rough
from ring_scenes import clipmap_of, patches_of, surface_errors

from terrain_gl import reference
from terrain_gl.gpu import layout
from terrain_gl.heightmap import Heightmap
from terrain_gl.verify.holes import bilinear

RNG = np.random.default_rng(12)
ENDS = ("low", "mid", "high")


def drawn(heights, low, mid, high, vertices, y, x):
    """Height of a fan at places inside its node. `vertices`: posts of each side of the node that are vertices."""
    d = np.stack([y - mid[0], x - mid[1]])
    reach = np.where(d < 0, (mid - low)[:, None], (high - mid)[:, None])
    out = np.where(reach > 0, np.abs(d) / np.maximum(reach, 1), 0.0)  # 0 at the centre, 1 on an edge
    found = np.full(len(y), heights[tuple(mid)], float)
    for axis, far in vertices:  # the axis across which the wedge opens
        inside = (out[axis] == out.max(0)) & ((d[axis] >= 0) == far) & (out[axis] > 0)
        at = mid[1 - axis] + d[1 - axis][inside] / out[axis][inside]  # where the ray from the centre meets the edge
        row = heights[(high if far else low)[0]] if axis == 0 else heights[:, (high if far else low)[1]]
        edge = np.interp(at, vertices[axis, far], row[vertices[axis, far]])
        found[inside] = out[axis][inside] * edge + (1 - out[axis][inside]) * heights[tuple(mid)]
    return found


def some_vertices(low, mid, high, share):
    """Corners and middles of a node's edges, and some of their other posts."""
    found = {}
    for axis, far in [(0, False), (0, True), (1, False), (1, True)]:
        posts = np.arange(low[1 - axis], high[1 - axis] + 1)
        ends = [each[1 - axis] for each in (low, mid, high)]
        found[axis, far] = posts[(RNG.random(len(posts)) < share) | np.isin(posts, ends)]
    return found


@pytest.mark.parametrize("shape", [(17, 17), (33, 33), (14, 19), (9, 30), (30, 12)])
def test_no_cuts_of_a_fan_break_its_bound(shape):
    """Any posts of the edges may be vertices. Places are on a grid of 8 × 8 a cell."""
    closest = np.zeros(5)
    for seed, level in np.ndindex(6, 5):
        if level == 0:
            continue
        heights = rough(*shape, seed=seed).astype(float) + RNG.normal(size=shape)
        bound = reference.cut_errors(heights, level).fan_largest
        axes = reference.node_axes(shape, level)
        for at in np.ndindex(bound.shape):
            low, mid, high = np.array(
                [[getattr(axis, end)[k] for axis, k in zip(axes, at, strict=True)] for end in ENDS]
            )
            y, x = (axis.ravel() for axis in np.mgrid[low[0] : high[0] + 0.1 : 0.125, low[1] : high[1] + 0.1 : 0.125])
            for share in (0.0, 0.3, 1.0):
                vertices = some_vertices(low, mid, high, share)
                off = np.abs(drawn(heights, low, mid, high, vertices, y, x) - bilinear(heights, x, y)).max()
                assert off <= bound[at] + 1e-9
                closest[level] = max(closest[level], off / bound[at])
    assert closest[1:].min() > (0.8 if shape[0] == shape[1] else 0.5)  # the rim's nodes have looser bounds


@pytest.fixture
def scene(ctx):
    scene = clipmap_of(ctx, Heightmap(rough(257, 257, 3, relief=200.0), 10.0), (320, 180))
    yield scene
    scene.release()


def with_fans(scene, largest):
    """Overwrite the largest errors of fans, in units of span · 2^-14."""
    words = np.frombuffer(scene.tables.ranges.read(), layout.NODE_RANGE).copy()
    words["fan_m"][:, 0] = largest
    scene.tables.ranges.write(words)


def test_without_fans_a_mesh_needs_more_triangles(scene):
    camera = cameras(scene.heightmap)["default"]
    with_bound = scene.select(camera, 0.5).triangles
    with_fans(scene, 2.0**14)
    assert scene.select(camera, 0.5).triangles > 1.05 * with_bound


def test_with_fans_of_no_error_the_promise_breaks(scene):
    camera = cameras(scene.heightmap)["default"]
    view = scene.select(camera, 0.5)
    assert surface_errors(scene, view, camera).max_px <= view.certified_px <= 0.5
    with_fans(scene, 0.0)
    view = scene.select(camera, 0.5)
    assert surface_errors(scene, view, camera).max_px > view.certified_px


@pytest.mark.parametrize("metric", ["max", "rms"])
@pytest.mark.parametrize("error", [0.3, 1.0])
def test_a_fan_stays_a_patch_of_its_own(scene, metric, error):
    """A pair has another triangulation. Some patches of 2 × 2 segments hold only as fans, and the promise holds."""
    camera = cameras(scene.heightmap)["default"]
    view = scene.select(camera, error, metric=metric)
    found = surface_errors(scene, view, camera)
    assert (found.max_px if metric == "max" else found.rms_px) <= view.certified_px <= error
    patches = patches_of(scene, view)
    alone = (patches.side_log2 - patches.step_log2 == 1) & ~patches.pair.any(1)
    assert alone.any()


def test_budgets_count_fans(scene):
    """With the mean errors of fans overwritten, the same budget gives another mesh."""
    camera = cameras(scene.heightmap)["default"]

    def mesh():
        view = scene.select(camera, 1.0, triangles=1500)
        return scene.levels.patches.read(layout.RING_PATCH.itemsize * view.patches)

    before, words = mesh(), np.frombuffer(scene.tables.ranges.read(), layout.NODE_RANGE).copy()
    words["fan_m"][:, 1] = 2.0**14
    scene.tables.ranges.write(words)
    assert mesh() != before
