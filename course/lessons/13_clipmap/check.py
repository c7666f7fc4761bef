"""Check of lesson 13: against the reference, which the project's shaders are tested with."""

import numpy as np

from course.checking import at_least, compare, holds, task
from course.land import land, spike
from course.truths import private
from terrain_gl import reference
from terrain_gl.reference import rings

TITLE = "The clipmap that the tables steer"
SIDES = "WEST", "NORTH", "EAST", "SOUTH"
LIMITS = 400 * 2.0 ** (-(np.arange(64) + 1) / 8)


@private
def origin_of(eye, blocks, level):
    """The first column and row of a ring."""
    return tuple(int(at) for at in rings.ring_origin(eye, (blocks, blocks), level))


@task("13.1 where a ring begins", points=1)
def origin(student, rng):
    """Tested for many eyes and levels."""
    asked = [(tuple(rng.uniform(-50, 900, 2)), int(rng.integers(1, 5)), int(rng.integers(0, 6))) for _ in range(200)]
    for level in range(6):  # eyes just before, at and behind a place where the ring moves on
        asked += [((float((26 << level) + side), float((62 << level) - side)), 2, level) for side in (-1e-3, 0, 1e-3)]
    want = [origin_of(*each) for each in asked]
    got = [student.ring_origin(*each) for each in asked]
    first = next((asked[i] for i in range(len(asked)) if list(got[i]) != list(want[i])), None)
    told = (
        ""
        if first is None
        else ", the first wrong one at eye ({:.7g}, {:.7g}), {} blocks, level {}".format(*first[0], *first[1:])
    )
    yield compare(f"218 rings{told}", got, want, axes=("ring", "axis"))
    yield holds("whole numbers", np.asarray(got).dtype.kind in "iu", "expected whole numbers, got others")


@task("13.2 the units that are drawn", points=2)
def units(student, rng):
    """Together the rings must cover each place once."""
    for blocks in (2, 3):
        eye, levels = tuple(rng.uniform(100, 130, 2)), 4
        ends = {level: origin_of(eye, blocks, level) for level in range(levels)}
        start, wide = np.array(ends[levels - 1]), blocks * 8 << levels - 1
        count = np.zeros((wide, wide), int)
        for level in range(levels):
            drawn = np.asarray(student.ring_units(eye, blocks, level))
            yield holds(
                f"ring {level}: the shape",
                drawn.shape == (8 * blocks,) * 2 and drawn.dtype == bool,
                f"expected {(8 * blocks,) * 2} bool, got {drawn.shape} {drawn.dtype}",
            )
            x, y = np.array(ends[level]) - start
            over = drawn.astype(int).repeat(1 << level, 0).repeat(1 << level, 1)
            count[y : y + len(over), x : x + len(over)] += over
        yield compare(f"{blocks} blocks: rings over each post", count, np.ones_like(count), axes=("row", "column"))


@private
def true_cut_errors(heights, level):
    """C of every cell of a level, at the posts."""
    y, x = reference.node_axes(heights.shape, level)
    pair = reference.quad_errors(heights, level)
    share = np.arange(pair[0].shape[1]) / (pair[0].shape[1] - 1)
    t, s = share[None, :, None, None], share[None, None, None, :]
    weights = np.stack(np.broadcast_arrays(1 - s, 1 - t, s, t, pair[0])[:4])
    up, down = reference.cut_edges(heights, level)[:, :, :, None, :, None].swapaxes(0, 1)
    above, below = np.maximum(*pair) + (weights * up).max(0), -np.minimum(*pair) + (weights * down).max(0)
    return np.maximum(above, below).max((1, 3))


@private
def true_quads(heights, level):
    """Errors of cells whose edges are not cut."""
    return np.maximum(*(np.abs(e).max((1, 3)) for e in reference.quad_errors(heights, level)))


@task("13.3 the error of a cell whose edges are cut", points=3)
def cut_error(student, rng):
    """Errors must be exact, and not below the errors without cut edges."""
    heights = spike(land(rng, 65, 65), rng)
    for level in (1, 2, 3, 4):
        n = 1 << level
        cells = [(y, x) for y, x in rng.integers(0, 64 >> level, (25, 2)) << level]
        want = true_cut_errors(heights, level)
        want = [want[y >> level, x >> level] for y, x in cells]
        whole = true_quads(heights, level)
        got = [student.cut_error(heights[y : y + n + 1, x : x + n + 1]) for y, x in cells]
        floor = [whole[y >> level, x >> level] for y, x in cells]
        yield at_least(f"level {level}: not below the error without cuts", got, floor, ("cell",))
        yield compare(f"level {level}", got, want, axes=("cell",))
    yield compare("a flat cell", student.cut_error(np.full((5, 5), 7.0)), 0.0)


def level_of(rng, rows, cols):
    """Errors of tiles, and their tables of counts."""
    errors = 300 * 2.0 ** -rng.uniform(0, 7, (rows, cols))
    errors[rows // 3 :, cols // 3 :] *= 2.0 ** -rng.uniform(2, 5)
    errors[rng.random(errors.shape) < 0.03] = 390.0
    return errors, counted(errors)


@private
def counted(errors):
    """The tables that count the tiles above each limit."""
    above = errors > LIMITS[:, None, None]
    return np.pad(above.cumsum(1).cumsum(2), ((0, 0), (1, 0), (1, 0))).astype(np.uint8)


@private
def largest_within(errors, tables, tile, low, end, last):
    """The largest error of the tiles that a box meets."""
    (x0, y0), (x1, y1) = rings.tiles_over(level_of_tables(tables, tile), 0, low, end, last)
    return float(errors[y0:y1, x0:x1].max())


@private
def answers(tables, tile, low, end, last, error_m):
    """Whether the tables say that a box is within the error."""
    return bool(rings.is_within([level_of_tables(tables, tile)], low, end, last, 0, error_m))


@private
def level_of_tables(tables, tile):
    """Tables as the reference has them."""
    return rings.ClassTables([table[1:, 1:] for table in tables], tile, 400.0, LIMITS)


def _kind(error_m, low, end, last):
    """What is special about a box, for the message."""
    kinds = {
        "no error is above it": error_m >= 400,
        "exactly a limit": error_m in LIMITS,
        "below all limits": error_m < LIMITS[-1],
        "the box sticks out of the map": min(low) < 0 or any(at > n for at, n in zip(end, last, strict=True)),
    }
    return "".join(f" ({name})" for name, holds_here in kinds.items() if holds_here)


@task("13.4 any box", points=3)
def within(student, rng):
    """Tested on boxes that do not begin at tiles, at the map's rim, and with entries of tables above 255."""
    rows, cols = (int(n) for n in rng.integers(40, 60, 2))
    errors, tables = level_of(rng, rows, cols)
    got, want, over, wrong = [], [], [], ""
    for i in range(400):
        tile = int(rng.choice([2, 4, 8]))
        side = int(rng.integers(1, 14 * tile))
        last = (cols * tile, rows * tile)
        low = tuple(int(rng.integers(1 - side, n)) for n in last)
        end = tuple(at + side for at in low)
        true = largest_within(errors, tables, tile, low, end, last)
        error_m = float(true * rng.choice([0.9, 1.0, 1.01, 1.1, 1.3]))
        if i % 5 == 0:  # exactly at the limit of the largest error's class, or at another limit
            tight = min([limit for limit in LIMITS if limit >= true], default=400.0)
            error_m = float(tight if i % 2 else rng.choice(LIMITS[8:40]))
        error_m = 401.0 if i == 1 else 400.0 if 2 < i < 12 else float(LIMITS[-1] / 2) if i == 2 else error_m
        want.append(answers(tables, tile, low, end, last, error_m))
        got.append(bool(student.is_within(tables, LIMITS, 400.0, low, end, tile, error_m)))
        over.append(got[-1] and true > error_m)
        if got[-1] != want[-1] and not wrong:
            told = f"box {i}, low {low}, end {end}, tile {tile}, span_m 400, {cols} × {rows} tiles"
            wrong = f"{told}, error_m {error_m!r}{_kind(error_m, low, end, last)}: yours {got[-1]}, expected {want[-1]}"
    yield holds("the first wrong box", not wrong, wrong)
    yield holds("no box is over tolerance", not any(over), f"{sum(over)} of 400 boxes have a tile above the error")
    yield compare("400 boxes", np.array(got, int), np.array(want, int), axes=("box",))


def steps_of(rng, unit_log2):
    """Spacings of the squares of a block; a finer ring or the map's end may leave nothing to draw in a part of it."""
    finest = unit_log2 - 3
    allowed = rng.integers(finest, unit_log2 + 3, (8, 8)) if rng.random() < 0.5 else np.full((8, 8), unit_log2 + 2)
    rough = rng.random((8, 8)) < rng.uniform(0.02, 0.9)
    allowed[rough] = finest + (rng.random((8, 8)) < 0.5)[rough]
    missing, is_hole = np.zeros((8, 8), bool), rng.random() < 0.5
    if rng.random() < 0.7:
        missing[:, : (2 if is_hole else 1) * rng.integers(1, 4)] = True
    steps = {}
    for depth in range(4):
        side = 8 >> depth
        for y, x in np.ndindex(1 << depth, 1 << depth):
            part = np.s_[y * side : (y + 1) * side, x * side : (x + 1) * side]
            if missing[part].all():
                continue
            step = min(unit_log2 + 2 - depth, int(allowed[part][~missing[part]].min()))  # two segments a side, or more
            whole = depth == 3 or not is_hole or not missing[part].any()
            steps[depth, x, y] = step if whole else None
    return steps


@private
def true_block(steps, unit_log2):
    """The cheapest squares of a block."""
    return rings.cut_block(steps, unit_log2, can_refine=False)


@task("13.5 cut a block", points=3)
def block(student, rng):
    """The squares of a block must be the cheapest."""
    for i in range(150):
        unit_log2 = int(rng.integers(3, 6))
        steps = steps_of(rng, unit_log2)
        if i == 0:  # a block whose cut would be another one if triangles cost three halves as much
            unit_log2, steps = 4, steps_of(np.random.default_rng(91), 4)
        want = true_block(steps, unit_log2)
        got = np.asarray(student.cut_block(steps, unit_log2))
        if got.shape != want.shape:
            yield compare(f"block {i}", got, want)
            continue
        for number, name in enumerate(("log2 of the units a side", "log2 of the spacing")):
            yield compare(f"block {i}, {name}", got[..., number], want[..., number], axes=("row", "column"))


def tiling(rng, size_log2=5):
    """Squares of different sizes that cover a map once: x, y, log2 of the side and of the spacing."""
    found = []

    def cut(x, y, log2):
        if log2 > 1 and rng.random() < 0.75 - 0.1 * (size_log2 - log2) or log2 == size_log2:
            half = 1 << log2 - 1
            for dy, dx in np.ndindex(2, 2):
                cut(x + dx * half, y + dy * half, log2 - 1)
        else:
            found.append((x, y, log2, int(rng.integers(0, log2))))

    cut(0, 0, size_log2)
    return np.array(found)


@private
def true_edges(squares, asked):
    """The spacings of edges."""
    leaves = [rings.Leaf((x, y), side, step) for x, y, side, step in squares.tolist()]
    over = rings.leaf_map(leaves, (33, 33))
    return [int(rings.edge_step_log2(leaves, over, *each)) for each in asked]


@task("13.6 one rule for edges", points=3)
def edges(student, rng):
    """Both sides of an edge must get the same vertices."""
    for i in range(4):
        squares = tiling(rng)
        asked = [(k, side) for k in range(len(squares)) for side in range(4)]
        asked = [asked[k] for k in rng.permutation(len(asked))[:120]]
        want = true_edges(squares, asked)
        got = [student.edge_step(squares, *each) for each in asked]
        finer = sum(g > w for g, w in zip(got, want, strict=True))
        yield holds(f"map {i}: no crack", finer == 0, f"{finer} of {len(asked)} sides lack vertices of a neighbour")
        wrong = [(*each, g, w) for each, g, w in zip(asked, got, want, strict=True) if g != w]
        for k, side, g, w in wrong[:1]:
            x, y, log2, step = squares[k].tolist()
            told = f"{SIDES[side]} of the square at ({x}, {y}), {1 << log2} posts wide, of spacing {1 << step}"
            yield holds(f"map {i}", False, f"{told}: yours {g}, expected {w} (log2)")
        yield compare(f"map {i}", got, want, axes=("side",))
