"""Counters of classes against three ways to keep maxima: time, memory and tightness, for squares and for long boxes.

squares      the largest error of every window of 2^k × 2^k cells: four that overlap cover a square
rectangles   the same for every window of 2^a × 2^b cells: four that overlap cover any box
pyramid      the largest error of every second, fourth, ... cell's node: at most four nodes cover any box, and more

Run: python course/lessons/04_integral_histograms/rivals.py
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load
from course.land import land

truth = load(Path(__file__).parent / "check.py")
CELLS, BOXES, CLASSES, PER_OCTAVE = 512, 20_000, 64, 4


def windows(errors):
    """Tables of maxima: [k][y, x] is the largest error of the window of 2^k × 2^k cells that begins at (x, y)."""
    found, step = [errors], 1
    while 2 * step <= min(errors.shape):
        last = found[-1]
        along = np.maximum(last[:, :-step], last[:, step:])
        found.append(np.maximum(along[:-step], along[step:]))
        step *= 2
    return found


def largest(tables, boxes):
    """The largest error of each box, exact, and the fetches for it."""
    got, fetches = [], 0
    for x0, y0, x1, y1 in boxes.tolist():
        k = min(x1 - x0, y1 - y0).bit_length() - 1
        xs = [*range(x0, x1 - (1 << k), 1 << k), x1 - (1 << k)]
        ys = [*range(y0, y1 - (1 << k), 1 << k), y1 - (1 << k)]
        got.append(tables[k][np.ix_(ys, xs)].max())
        fetches += len(xs) * len(ys)
    return np.array(got), fetches / len(boxes)


def all_windows(errors):
    """Tables of maxima by (a, b): [y, x] is the largest error of the 2^b rows and 2^a columns that begin at (x, y)."""
    found = {(0, 0): errors}
    for b in range(errors.shape[0].bit_length()):
        if b:
            last, step = found[0, b - 1], 1 << (b - 1)
            found[0, b] = np.maximum(last[:-step], last[step:])
        for a in range(1, errors.shape[1].bit_length()):
            last, step = found[a - 1, b], 1 << (a - 1)
            found[a, b] = np.maximum(last[:, :-step], last[:, step:])
    return found


def largest_of_any(tables, boxes):
    """The largest error of each box, exact: four fetches."""
    got = []
    for x0, y0, x1, y1 in boxes.tolist():
        a, b = (x1 - x0).bit_length() - 1, (y1 - y0).bit_length() - 1
        xs, ys = (x0, x1 - (1 << a)), (y0, y1 - (1 << b))
        got.append(tables[a, b][np.ix_(ys, xs)].max())
    return np.array(got)


def pyramid(errors):
    """Levels of maxima: a node of level k covers 2^k × 2^k cells."""
    found = [errors]
    while len(found[-1]) > 1:
        last = found[-1]
        found.append(np.maximum.reduce([last[::2, ::2], last[1::2, ::2], last[::2, 1::2], last[1::2, 1::2]]))
    return found


def bound_of_nodes(levels, boxes):
    """A bound of each box: the largest of the four nodes, at most, that are as large as its longer side."""
    got = []
    for x0, y0, x1, y1 in boxes.tolist():
        k = (max(x1 - x0, y1 - y0) - 1).bit_length()
        got.append(levels[k][y0 >> k : (y1 - 1 >> k) + 1, x0 >> k : (x1 - 1 >> k) + 1].max())
    return np.array(got)


def of_one_size(tables, k, boxes):
    """As `largest`, all at the same time, for squares between 2^k and 2^(k + 1) cells: four fetches each."""
    x0, y0, x1, y1 = boxes.T
    xs, ys = (x0, x1 - (1 << k)), (y0, y1 - (1 << k))
    return np.maximum.reduce([tables[k][y, x] for y in ys for x in xs])


def within(tables, limits, tolerance_m, boxes):
    """Whether each box is within one tolerance: one class, four fetches."""
    table = tables[int(np.argmax(limits <= tolerance_m))]
    x0, y0, x1, y1 = boxes.T
    return table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0] == 0


def boxes_of(rng, width, height, square=False):
    """Boxes with sides in these ranges."""
    size = np.stack([rng.integers(*each, BOXES) for each in (width, height)], 1)
    if square:
        size[:, 1] = size[:, 0]
    low = rng.integers(0, CELLS - size + 1)
    return np.concatenate([low, low + size], 1)


def seconds(run):
    """The shortest of three times."""
    times = []
    for _ in range(3):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def main():
    """Measure all."""
    rng = np.random.default_rng(4)
    heights = land(rng, CELLS + 1, CELLS + 1)
    errors = np.abs(np.diff(np.diff(heights, axis=0), axis=1)) / 4 + 1e-3
    span = float(errors.max())
    limits = span * 2.0 ** (-(np.arange(CLASSES) + 1) / PER_OCTAVE)
    counts = np.zeros((CLASSES, CELLS + 1, CELLS + 1), np.uint32)
    np.cumsum((errors > limits[:, None, None]).cumsum(1, dtype=np.uint32), axis=2, out=counts[:, 1:, 1:])
    maxima = windows(errors.astype(np.float32))
    of_any, levels = all_windows(errors.astype(np.float32)), pyramid(errors.astype(np.float32))
    print(f"memory, a cell: counters {counts.nbytes / errors.size:.0f} bytes, or {CLASSES} with counters of 8 bits")
    for name, tables in (("squares", maxima), ("rectangles", of_any.values()), ("pyramid", levels)):
        print(f"                {name} {4 * sum(table.size for table in tables) / errors.size:.3g} bytes")
    squares, long = boxes_of(rng, (1, 65), (1, 65), square=True), boxes_of(rng, (128, 257), (4, 9))
    for name, boxes in (("squares of 1 to 64 cells a side", squares), ("boxes of 128 x 4 to 256 x 8 cells", long)):
        true = truth.true_maximum(errors.astype(np.float32), boxes)
        exact, fetches = largest(maxima, boxes)
        empty = np.stack([within(counts, limits, limit, boxes) for limit in limits]).sum(0)
        bound = np.append(span, limits)[empty]
        widened = bound_of_nodes(levels, boxes)
        assert (exact == true).all() and (bound >= true * (1 - 1e-6)).all() and (widened >= true).all()
        assert (largest_of_any(of_any, boxes) == true).all()
        inside = true > limits[-1]
        loose = (bound / true)[inside]
        print(
            f"{name}: counters 4 fetches for a tolerance, {loose.mean():.2f} times the truth, {loose.max():.2f} at most"
        )
        print(f"{'':{len(name)}}  squares {fetches:.1f} fetches, exact; rectangles 4 fetches, exact")
        loose = widened / true
        print(f"{'':{len(name)}}  pyramid 4 fetches, {np.median(loose):.1f} times the truth in the median")
    squares = boxes_of(rng, (32, 64), (32, 64), square=True)
    one = seconds(lambda: within(counts, limits, 1.0, squares)) / BOXES * 1e9
    four = seconds(lambda: of_one_size(maxima, 5, squares) <= 1.0) / BOXES * 1e9
    print(f"time, whether a square is within a tolerance: counters {one:.0f} ns, maxima {four:.0f} ns (numpy)")


if __name__ == "__main__":
    main()
