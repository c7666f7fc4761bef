"""Check of lesson 1: unequal spacing, maps that are not square, places on the edges, voids at the rim."""

import numpy as np

from course.checking import at_most, compare, task
from course.land import land, voids
from course.truths import private
from terrain_gl import reference

TITLE = "Heightmaps and the truth"


def map_of(rng):
    """Heights and spacing of a map that is not square."""
    rows, cols = (int(n) for n in rng.integers(20, 60, 2))
    return land(rng, rows, cols + 7), tuple(rng.uniform(5, 40, 2))


@private
def true_places(heights, spacing):
    """Where each post stands, (rows, cols, 3)."""
    return np.moveaxis(reference.world_m(heights, spacing), 0, -1)


@private
def true_heights(heights, u, v):
    """Heights at columns u and rows v."""
    return reference.bilinear_heights(heights, u, v)


@private
def true_normals(heights, spacing):
    """Normals in the middle of the cells."""
    return reference.normals_of(heights, spacing)


@task("1.1 where posts stand", points=2)
def world(student, rng):
    """Maps of several sizes: row 0 is the north edge."""
    heights, spacing = map_of(rng)
    want = true_places(heights, spacing)
    yield compare("x, y, z of every post", student.world(heights, spacing), want, axes=("row", "column", "axis"))


@task("1.2 the truth", points=3)
def height_at(student, rng):
    """Places between posts, on posts and on the map's edges."""
    heights, spacing = map_of(rng)
    rows, cols = heights.shape
    u, v = rng.uniform(0, cols - 1, 3000), rng.uniform(0, rows - 1, 3000)
    u[:200], v[100:300] = np.rint(u[:200]), np.rint(v[100:300])
    u[:40], v[20:60], u[60:80], v[70:90] = 0, rows - 1, cols - 1, 0
    x, y = u * spacing[0], (rows - 1 - v) * spacing[1]
    x, y = np.minimum(x, (cols - 1) * spacing[0]), np.minimum(y, (rows - 1) * spacing[1])
    want = true_heights(heights, u, v)
    yield compare("3000 places", student.height_at(heights, spacing, x, y), want, axes=("place",))


@task("1.3 normals", points=3)
def normals(student, rng):
    """Tested on land, and on a plane whose normal is known."""
    heights, spacing = map_of(rng)
    want = true_normals(heights, spacing)
    yield compare("land", student.normals(heights, spacing), want, axes=("row", "column", "axis"))
    x, y, _ = np.moveaxis(true_places(heights, spacing), -1, 0)
    plane = 0.3 * x - 0.7 * y + 900
    want = np.broadcast_to(np.array([-0.3, 0.7, 1]) / np.sqrt(1.58), (*(n - 1 for n in plane.shape), 3))
    yield compare("a plane", student.normals(plane, spacing), want, axes=("row", "column", "axis"))


@private
def harmonic(heights, void):
    """The filled heights, from one system of linear equations: each void post is the mean of its neighbours."""
    number = np.where(void, np.cumsum(void).reshape(void.shape) - 1, -1)
    n = int(void.sum())
    matrix, right = np.eye(n), np.zeros(n)
    for y, x in zip(*np.nonzero(void), strict=True):
        around = [(y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)]
        around = [(b, a) for b, a in around if 0 <= b < void.shape[0] and 0 <= a < void.shape[1]]
        for at in around:
            if void[at]:
                matrix[number[y, x], number[at]] -= 1 / len(around)
            else:
                right[number[y, x]] += heights[at] / len(around)
    filled = heights.copy()
    filled[void] = np.linalg.solve(matrix, right)
    return filled


@task("1.4 voids", points=3)
def fill(student, rng):
    """Tested with voids at the rim, and with heights at voids that are meaningless, or look like land."""
    for name, depth_m in (("meaningless heights", -32768.0), ("heights like land", rng.uniform(900, 1400))):
        heights, _ = map_of(rng)
        void = voids(rng, *heights.shape, 5)
        void[5:9, 5:10] = True
        damaged = np.where(void, depth_m, heights)
        want = harmonic(damaged, void)
        got = np.asarray(student.fill(damaged, void))
        if got.shape != void.shape:
            yield compare(name, got, want)
            return
        axes = ("row", "column")
        yield compare(f"{name}: posts with data", np.where(void, 0, got), np.where(void, 0, heights), axes=axes)
        smooth = f"{name}: distance of void posts from the smooth height"
        yield at_most(smooth, np.abs(got - want), np.full(void.shape, 0.01), axes)


@task("1.5 who counts", points=1)
def mean_height(student, rng):
    """Void posts must not count in the mean."""
    heights, _ = map_of(rng)
    void = voids(rng, *heights.shape)
    yield compare("the mean", student.mean_height(np.where(void, -32768.0, heights), void), heights[~void].mean())
