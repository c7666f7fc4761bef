"""Check of lesson 8: levels and triangles as the driver has made them, captured."""

import numpy as np

from course.checking import areas, compare, holds, task
from course.land import land
from course.shaders import ready, runner

TITLE = "Tessellation hardware"
NAMES = {"control", "evaluation"}
OPENGL = 410  # where macOS ends


@task("8.1 control: the levels", points=3)
def control(student, rng):
    """Each edge must get its segments; a patch that is not drawn must get level 0."""
    texts = student.shaders()
    hindrance = ready(student, texts, {"control"}, OPENGL)
    if hindrance is not None:
        yield hindrance
        return
    n = 40
    squares = np.column_stack([rng.integers(0, 100, (n, 2)), np.full(n, 24), rng.random(n) < 0.7]).astype(np.int32)
    edges, inner = rng.integers(1, 33, (n, 4)).astype(np.int32), rng.integers(2, 33, n).astype(np.int32)
    north, east, south, west = edges.T
    want = np.column_stack([west, north, east, south, inner, inner]) * squares[:, 3:]
    with runner(student, texts) as found:
        got = found.levels(texts["control"], squares, edges, inner)
    for name, levels in (("outer levels 0 to 3", slice(0, 4)), ("inner levels 0 and 1", slice(4, 6))):
        yield compare(name, got[:, levels], want[:, levels], axes=("patch", "level"))


def lattice(squares, inner, shape):
    """Posts of patches with the same segments everywhere, on a map of (rows, cols)."""
    found = set()
    for (x, y, side, _), n in zip(squares.tolist(), inner.tolist(), strict=True):
        at = np.arange(n + 1) * (side // n)
        found |= {(min(x + i, shape[1] - 1), min(y + j, shape[0] - 1)) for i in at.tolist() for j in at.tolist()}
    return np.array(sorted(found))


@task("8.2 evaluation: the vertices", points=4)
def evaluation(student, rng):
    """Vertices must be on their posts, triangles counter-clockwise, for all numbers of segments, also at the rim."""
    texts = student.shaders()
    hindrance = ready(student, texts, {"evaluation"}, OPENGL)
    if hindrance is not None:
        yield hindrance
        return
    with runner(student, texts) as found:
        for segments in (2, 3, 5, 6, 7, 11, 13, 24, 31):
            side = segments * int(rng.integers(1, 4))
            past = -1 if segments % 2 else side // 3  # patches of odd segments fit; other patches pass the map's rim
            shape = (side - past, 2 * side - past)[:: -1 if segments % 3 else 1]  # wide and high maps
            heights = land(rng, *shape).astype(np.float32)
            squares = np.array(
                [(x, y, side, 1) for y in range(0, shape[0] - 1, side) for x in range(0, shape[1] - 1, side)], np.int32
            )
            inner = np.full(len(squares), segments, np.int32)
            ones = np.ones((len(squares), 4), np.int32)
            got = found.mesh(None, texts["evaluation"], heights, squares, ones, inner)
            name = f"{segments} segments"
            vertices = np.unique(got.reshape(-1, 3), axis=0) if len(got) else np.zeros((0, 3))
            want = lattice(squares, inner, shape)
            want = np.column_stack([want, heights[want[:, 1], want[:, 0]]])
            yield compare(f"{name}: column, row and height of the vertices", vertices, want, axes=("vertex", "number"))
            turns = -areas(got[..., :2].astype(float))  # rows run to the south
            turned = int((turns < 0).sum())
            yield holds(f"{name}: turned", turned == 0, f"{turned} triangles are clockwise seen from above")
            yield compare(
                f"{name}: the area in cells", float(np.abs(turns).sum()), float((shape[0] - 1) * (shape[1] - 1))
            )


def blocks(rng, segments):
    """4 × 4 blocks, some of them cut in four; an edge has twice the segments where the neighbour is cut."""
    base = 2 * segments
    cut = np.pad(rng.random((4, 4)) < 0.5, 1)
    squares, edges = [], []
    for y, x in np.ndindex(4, 4):
        if cut[y + 1, x + 1]:
            squares += [(2 * base * x + dx, 2 * base * y + dy, base, 1) for dy in (0, base) for dx in (0, base)]
            edges += [(segments,) * 4] * 4
        else:
            beside = cut[y, x + 1], cut[y + 1, x + 2], cut[y + 2, x + 1], cut[y + 1, x]
            squares.append((2 * base * x, 2 * base * y, 2 * base, 1))
            edges.append(tuple(segments * (2 if finer else 1) for finer in beside))
    return np.array(squares, np.int32), np.array(edges, np.int32), 8 * base + 1


@task("8.3 both: no cracks", points=3)
def both(student, rng):
    """Patches of different sizes: every edge inside must be shared by two triangles."""
    texts = student.shaders()
    hindrance = ready(student, texts, NAMES, OPENGL)
    if hindrance is not None:
        yield hindrance
        return
    with runner(student, texts) as found:
        for segments in (3, 4, 5, 7):
            squares, edges, size = blocks(rng, segments)
            heights = land(rng, size, size).astype(np.float32)
            inner = np.full(len(squares), segments, np.int32)
            got = found.mesh(texts["control"], texts["evaluation"], heights, squares, edges, inner)
            name = f"{segments} segments"
            yield compare(
                f"{name}: the area in cells",
                float(np.abs(areas(got[..., :2].astype(float))).sum()),
                float((size - 1) ** 2),
            )
            ends = np.stack([got, np.roll(got, -1, 1)], 2).reshape(-1, 2, 3)
            order = np.lexsort(ends.transpose(1, 2, 0)[:, :2].reshape(-1, len(ends))) if len(ends) else []
            _, bits = np.unique(ends.reshape(-1, 3), axis=0, return_inverse=True)
            pairs = np.sort(bits.reshape(-1, 2), 1)[order]
            unique, uses = np.unique(pairs, axis=0, return_counts=True)
            places = np.unique(ends.reshape(-1, 3), axis=0)[unique][..., :2]
            rim = ((places[:, 0] == places[:, 1]) & np.isin(places[:, 0], (0, size - 1))).any(1)
            loose = int((uses != np.where(rim, 1, 2)).sum())
            yield holds(f"{name}: edges", loose == 0, f"{loose} edges are not shared by two triangles")
