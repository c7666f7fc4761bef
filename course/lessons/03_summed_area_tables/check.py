"""Check of lesson 3: whole numbers, so every answer is exact or wrong."""

import numpy as np

from course.checking import compare, grows_with_the_box, holds, task
from course.shaders import prefix_sums
from course.truths import private

TITLE = "Summed-area tables"
OTHER_STRIPS = 16, 7


def words(rng, rows, cols):
    """16-bit heights in 32-bit words: a slope with noise."""
    y, x = np.indices((rows, cols))
    return (20000 + 30 * x % 20000 + 10 * y % 15000 + rng.integers(0, 9000, (rows, cols))).astype(np.uint32)


def sizes(rng):
    """Lengths of rows: shorter than a strip, one strip, one value more, and others."""
    return [(3, 10), (5, 64), (4, 65), (7, int(rng.integers(200, 400)))]


@private
def running(values, before, strip):
    """Running sums in each strip, which begin with given numbers."""
    want = np.empty(values.shape, np.uint32)
    for i in range(values.shape[1]):
        want[:, i] = values[:, i] + (want[:, i - 1] if i % strip else before[:, i // strip])
    return want


@private
def strip_sums(values, strip):
    """The sum of each strip, modulo 2^32."""
    return np.add.reduceat(values.astype(np.uint64), np.arange(0, values.shape[1], strip), axis=1).astype(np.uint32)


@private
def sums_before(sums):
    """The sum of the strips before each strip, modulo 2^32."""
    return np.pad(sums.astype(np.uint64).cumsum(1), ((0, 0), (1, 0)))[:, :-1].astype(np.uint32)


@private
def true_table(values):
    """The table, modulo 2^32."""
    return values.astype(np.uint64).cumsum(0).cumsum(1).astype(np.uint32)


@private
def true_boxes(values, asked):
    """The sum of each box."""
    return np.array([values[y0:y1, x0:x1].sum() for x0, y0, x1, y1 in asked], np.uint32)


@task("3.1 reduce: the sum of each strip", points=2)
def reduce(student, rng):
    """Tested with short last strips, and with sums that wrap."""
    for rows, n in sizes(rng):
        values = words(rng, rows, n)
        want = strip_sums(values, 64)
        yield compare(f"rows of {n}", student.reduce(values), want, axes=("row", "strip"))
    for strip in OTHER_STRIPS:
        values = words(rng, 3, 50)
        want = strip_sums(values, strip)
        yield compare(f"strips of {strip}", student.reduce(values, strip), want, axes=("row", "strip"))
    values = rng.integers(0, 2**32, (3, 150), dtype=np.uint32)
    want = strip_sums(values, 64)
    yield compare("sums that wrap", student.reduce(values), want, axes=("row", "strip"))


@task("3.2 scan: what stands before each strip", points=2)
def scan(student, rng):
    """A strip's own sum must not count; sums may wrap."""
    sums = rng.integers(0, 2**32, (6, 17), dtype=np.uint32)
    want = sums_before(sums)
    yield compare("sums before", student.scan(sums), want, axes=("row", "strip"))
    yield compare("a single strip", student.scan(sums[:, :1]), np.zeros((6, 1), np.uint32), axes=("row", "strip"))


@task("3.3 propagate: the running sum", points=2)
def propagate(student, rng):
    """Any number may be the sum before a strip."""
    for rows, n in sizes(rng):
        values = words(rng, rows, n)
        before = rng.integers(0, 2**32, (rows, -(-n // 64)), dtype=np.uint32)
        want = running(values, before, 64)
        yield compare(f"rows of {n}", student.propagate(values, before), want, axes=("row", "column"))
    for strip in OTHER_STRIPS:
        values, before = words(rng, 3, 50), rng.integers(0, 2**32, (3, -(-50 // strip)), dtype=np.uint32)
        want = running(values, before, strip)
        yield compare(f"strips of {strip}", student.propagate(values, before, strip), want, axes=("row", "column"))


# In place of a student's function: the right shape, and nothing in it.
NOTHING = {
    "reduce": "lambda values, strip=64: values[:, ::strip] * 0",
    "scan": "lambda sums: sums * 0",
    "propagate": "lambda values, before, strip=64: values * 0",
}


@task("3.4 the table", points=2)
def sat(student, rng):
    """Tested on maps whose sums do not fit into 32 bits."""
    values = words(rng, int(rng.integers(320, 350)), int(rng.integers(620, 700)))
    want = true_table(values)
    table = student.sat(values)
    kind = np.asarray(table).dtype
    yield holds("the words have 32 bits", kind == np.uint32, f"your table is of {kind}, expected uint32")
    yield compare("every entry, modulo 2^32", table, want, axes=("row", "column"))
    values = words(rng, 70, 130)
    for name, ours in NOTHING.items():
        changed = student.call_with({name: ours}, "sat", values)
        used = not np.array_equal(changed, student.sat(values))
        yield holds(f"with your {name}()", used, f"the table is the same without your {name}()")


@task("3.5 boxes", points=3)
def boxes(student, rng):
    """Tested on small and large boxes, also at the rim; the sum of each box fits into 32 bits."""
    rows, cols = int(rng.integers(320, 350)), int(rng.integers(620, 700))
    values = words(rng, rows, cols)
    table = true_table(values)
    size = rng.integers(1, 250, (3000, 2))  # sums up to 2^32: signed words of 32 bits do not hold them
    low = rng.integers(0, [cols, rows], (3000, 2))
    low[:40, 0] = 0
    low[20:60, 1] = 0
    high = np.minimum(low + size, [cols, rows])
    asked = np.concatenate([low, high], 1)
    want = true_boxes(values, asked)
    yield compare("3000 boxes", student.box_sums(table, asked), want, axes=("box",))
    corner = np.zeros((4000, 2), int)
    small, large = (np.concatenate([corner, corner + side], 1) for side in (1, 1500))
    table = rng.integers(0, 2**32, (1500, 1500), dtype=np.uint32)
    slow = grows_with_the_box(lambda asked: student.box_sums(table, asked), small, large)
    yield holds(
        "large boxes", not slow, "boxes of 1500 x 1500 posts take far longer than single posts: fetch four words"
    )


@task("3.6 the same on the GPU", points=4)
def shaders(student, rng):
    """Run the student's shaders over rows, then over columns."""
    texts = student.shaders()
    maps = words(rng, 70, 64), words(rng, int(rng.integers(65, 200)), int(rng.integers(65, 300)))
    yield from prefix_sums(student, texts, [(values, true_table(values)) for values in maps])
