"""Counters of classes against tables of maxima: time, memory and tightness, for squares and for long boxes.

A table of maxima holds the largest error of every window of 2^k × 2^k cells. Four windows that overlap cover a square.
A long box needs more of them, one after another.

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
    """Measure both."""
    rng = np.random.default_rng(4)
    heights = land(rng, CELLS + 1, CELLS + 1)
    errors = np.abs(np.diff(np.diff(heights, axis=0), axis=1)) / 4 + 1e-3
    span = float(errors.max())
    limits = span * 2.0 ** (-(np.arange(CLASSES) + 1) / PER_OCTAVE)
    counts = np.zeros((CLASSES, CELLS + 1, CELLS + 1), np.uint32)
    np.cumsum((errors > limits[:, None, None]).cumsum(1, dtype=np.uint32), axis=2, out=counts[:, 1:, 1:])
    maxima = windows(errors.astype(np.float32))
    words = sum(table.size for table in maxima)
    print(f"memory, a cell: counters {counts.nbytes / errors.size:.0f} bytes, or {CLASSES} with counters of 8 bits")
    print(f"                maxima {4 * words / errors.size:.0f} bytes")
    squares, long = boxes_of(rng, (1, 65), (1, 65), square=True), boxes_of(rng, (128, 257), (4, 9))
    for name, boxes in (("squares of 1 to 64 cells a side", squares), ("boxes of 128 x 4 to 256 x 8 cells", long)):
        true = truth.true_maximum(errors.astype(np.float32), boxes)
        exact, fetches = largest(maxima, boxes)
        empty = np.stack([within(counts, limits, limit, boxes) for limit in limits]).sum(0)
        bound = np.append(span, limits)[empty]
        assert (exact == true).all() and (bound >= true * (1 - 1e-6)).all()
        inside = true > limits[-1]
        loose = (bound / true)[inside]
        print(
            f"{name}: counters 4 fetches for a tolerance, {loose.mean():.2f} times the truth, {loose.max():.2f} at most"
        )
        print(f"{'':{len(name)}}  maxima {fetches:.1f} fetches, exact")
    squares = boxes_of(rng, (32, 64), (32, 64), square=True)
    one = seconds(lambda: within(counts, limits, 1.0, squares)) / BOXES * 1e9
    four = seconds(lambda: of_one_size(maxima, 5, squares) <= 1.0) / BOXES * 1e9
    print(f"time, whether a square is within a tolerance: counters {one:.0f} ns, maxima {four:.0f} ns (numpy)")


if __name__ == "__main__":
    main()
