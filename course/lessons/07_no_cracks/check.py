"""Check of lesson 7: broken meshes are leaves of unbalanced quadtrees, two triangles each."""

import numpy as np

from course.checking import compare, holds, task
from course.land import land
from course.truths import private

TITLE = "No cracks"


def leaves(rng, x, y, side):
    """Random leaves, x, y, side; neighbours may be several levels apart."""
    if side == 1 or (side < 16 and rng.random() < 0.45):
        return [(x, y, side)]
    half = side // 2
    return [leaf for dy in (0, half) for dx in (0, half) for leaf in leaves(rng, x + dx, y + dy, half)]


def broken(rng, size=16):
    """Vertices and triangles with T-junctions; triangles share vertices."""
    heights, spacing = land(rng, size + 1, size + 1), rng.uniform(5, 30, 2)
    triangles, number = [], {}

    def at(x, y):
        return number.setdefault((x, y), len(number))

    for x, y, side in leaves(rng, 0, 0, size):
        a, b, c, d = at(x, y), at(x + side, y), at(x + side, y + side), at(x, y + side)
        triangles += [(a, b, c), (a, c, d)] if rng.random() < 0.5 else [(a, b, d), (b, c, d)]
    places = np.array(list(number))
    vertices = np.column_stack([places * spacing, heights[places[:, 1], places[:, 0]]])
    return vertices, np.array(triangles), places


def turned(vertices, rng):
    """The same mesh, turned about the vertical: its coordinates are not exact any more."""
    angle = rng.uniform(0.1, 1.4)
    x, y, z = vertices.T
    return np.column_stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), z])


@private
def true_open(triangles):
    """The edges that only one triangle uses."""
    uses = {}
    for t in triangles.tolist():
        for a, b in zip(t, t[1:] + t[:1], strict=True):
            uses[min(a, b), max(a, b)] = uses.get((min(a, b), max(a, b)), 0) + 1
    return sorted(edge for edge, n in uses.items() if n == 1)


def rim(edges, places, size=16):
    """Which edges lie on the map's rim."""
    ends = places[np.asarray(edges).reshape(-1, 2)]
    return ((ends[:, 0] == ends[:, 1]) & np.isin(ends[:, 0], (0, size))).any(1)


@task("7.1 open edges", points=2)
def open_edges(student, rng):
    """A mesh without cracks has open edges only on the rim; a broken mesh has more, inside the map."""
    for name in ("a broken mesh", "a mesh with edges of three and four triangles"):
        _, triangles, _ = broken(rng)
        if name != "a broken mesh":
            triangles = np.concatenate([triangles, triangles[:5], triangles[:3]])
        rolled = np.array([np.roll(t, rng.integers(0, 3)) for t in triangles])
        want = np.array(true_open(rolled))
        yield compare(name, student.open_edges(rolled), want, axes=("edge", "end"))


@task("7.2 weld", points=2)
def weld(student, rng):
    """Tested on triangles with their own vertices, moved apart by rounding, and with a second mesh above the first."""
    for tolerance_m in (1e-3, 0.2):
        yield from welded(student, rng, tolerance_m)


def welded(student, rng, tolerance_m):
    """One mesh and its twin above, whose vertices are 20 tolerances apart."""
    vertices, triangles, _ = broken(rng)
    triangles = np.concatenate([triangles, triangles + len(vertices)])
    vertices = np.concatenate([vertices, vertices + [0, 0, 20 * tolerance_m]])
    own = vertices[triangles.ravel()] + rng.uniform(-1, 1, (triangles.size, 3)) * tolerance_m / 8
    order = rng.permutation(triangles.size)
    place = np.empty(triangles.size, int)
    place[order] = np.arange(triangles.size)
    shuffled, loose = own[order], place[np.arange(triangles.size).reshape(-1, 3)]
    lowest = {}
    for corner, vertex in sorted(zip(place.tolist(), triangles.ravel().tolist(), strict=True)):
        lowest.setdefault(vertex, corner)
    want = np.array([[lowest[v] for v in t] for t in triangles])
    got = student.weld(shuffled, loose, tolerance_m)
    yield compare(f"within {tolerance_m:g} m: numbers of vertices", got, want, axes=("triangle", "corner"))


@private
def true_on_edge(places, a, b):
    """The vertices inside an edge, in their order from a to b."""
    p, q = places[a], places[b]
    inside = [
        k
        for k, r in enumerate(places)
        if k not in (a, b)
        and np.cross(np.append(q - p, 0), np.append(r - p, 0))[2] == 0
        and 0 < (r - p) @ (q - p) < (q - p) @ (q - p)
    ]
    return np.array(sorted(inside, key=lambda k: (places[k] - p) @ (q - p)), int)


@task("7.3 vertices on an edge", points=2)
def on_edge(student, rng):
    """Tested on open edges, from either end. None runs along an axis.

    Each has a vertex near either end, and beside it one that is a millionth of its length away.
    """
    vertices, triangles, places = broken(rng)
    vertices = turned(vertices, rng)
    asked = [edge for edge in true_open(triangles)][:60]
    for i, (a, b) in enumerate(asked):
        a, b = (a, b) if i % 2 else (b, a)
        want = true_on_edge(places, a, b)
        x, y, _ = along = vertices[b] - vertices[a]
        near = vertices[a] + np.array([[0.01], [0.99]]) * along
        beside = (vertices[a] + vertices[b]) / 2 + 1e-6 * np.array([-y, x, 0])
        want = np.concatenate([[len(vertices)], want, [len(vertices) + 1]])
        got = student.on_edge(np.vstack([vertices, near, beside]), a, b)
        yield compare(f"the edge from {a} to {b}", got, want, axes=("place",))


def area(places, triangles):
    """Twice the signed area of each triangle, in posts."""
    p = places[triangles]
    (ax, ay), (bx, by) = (p[:, 1] - p[:, 0]).T, (p[:, 2] - p[:, 0]).T
    return ax * by - ay * bx


@task("7.4 repair", points=4)
def repair(student, rng):
    """Every edge inside must be shared by two triangles, and the map must be covered once."""
    for name in ("a broken mesh", "another one"):
        vertices, triangles, places = broken(rng)
        got = np.asarray(student.repair(turned(vertices, rng), triangles))
        sane = (
            got.ndim == 2
            and got.shape[1] == 3
            and got.dtype.kind in "iu"
            and got.size
            and got.min() >= 0
            and got.max() < len(vertices)
        )
        yield holds(f"{name}: triangles", bool(sane), "expected (m, 3) numbers of the vertices given")
        if not sane:
            continue
        twice = area(places, got)
        yield holds(
            f"{name}: turned as before",
            bool((twice > 0).all()),
            f"{(twice <= 0).sum()} are turned round or have no area",
        )
        yield compare(f"{name}: twice the area", int(np.abs(twice).sum()), 2 * 16 * 16)
        directed = got[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        number = directed @ [len(vertices), 1]  # of an edge in its direction
        alone = directed[~np.isin(number, directed @ [1, len(vertices)])]
        inner = int((~rim(alone, places)).sum())
        yield holds(f"{name}: edges", inner == 0, f"{inner} edges inside are used by one triangle")
        missing = len(vertices) - len(np.unique(got))
        yield holds(f"{name}: vertices", missing == 0, f"{missing} vertices are not used any more")
        twins = len(directed) - len(np.unique(directed, axis=0))
        yield holds(
            f"{name}: each edge once in a direction", twins == 0, f"{twins} edges are used twice in one direction"
        )
