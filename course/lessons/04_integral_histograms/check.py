"""Check of lesson 4: a bound is never below the truth, and never looser than the classes are."""

import numpy as np

from course.checking import at_least, at_most, compare, task
from course.land import land
from course.truths import private

TITLE = "Integral histograms"
SPAN_M, CLASSES, PER_OCTAVE = 500.0, 48, 4


@private
def true_limits(span_m, classes, per_octave):
    """The limits of the classes."""
    return np.array([span_m * 0.5 ** ((c + 1) / per_octave) for c in range(classes)])


@private
def true_classes(errors, limits):
    """The class of each error."""
    return np.array([sum(e <= limit for limit in limits) - 1 for e in errors])


@private
def true_tables(errors, limits):
    """Tables of the counts of cells above each limit."""
    return np.pad((errors > limits[:, None, None]).cumsum(1).cumsum(2), ((0, 0), (1, 0), (1, 0)))


@private
def true_tiles(errors, tile):
    """The largest error of each tile."""
    rows, cols = (-(-n // tile) for n in errors.shape)
    return np.array(
        [[errors[y * tile : (y + 1) * tile, x * tile : (x + 1) * tile].max() for x in range(cols)] for y in range(rows)]
    )


@private
def tight_boxes(boxes, tile):
    """The smallest boxes of tiles that hold these boxes."""
    return np.array([[x0 // tile, y0 // tile, (x1 - 1) // tile + 1, (y1 - 1) // tile + 1] for x0, y0, x1, y1 in boxes])


def errors_of(rng):
    """Errors of cells: smooth land, some errors exactly at a limit, and a wall of exactly 256 cells with large ones."""
    rows, cols = int(rng.integers(70, 110)), int(rng.integers(270, 330))
    errors = np.abs(np.diff(np.diff(land(rng, rows + 2, cols + 2), axis=0), axis=1))[:rows, :cols]
    errors *= 0.9 * SPAN_M / errors.max() * 0.1
    limits = true_limits(SPAN_M, CLASSES, PER_OCTAVE)
    errors[rng.random(errors.shape) < 0.02] = limits[20]
    errors[rng.random(errors.shape) < 0.02] = just_above(limits[22])
    errors[40, 5:261] = 450.0
    return errors, limits


def just_above(limits):
    """The next larger floats: errors just above these limits."""
    return np.nextafter(limits, np.inf)


def many_errors():
    """256 × 256 cells with a large error, which counters of 16 bits count as 0; and boxes, one over all these cells."""
    errors = np.zeros((260, 270))
    errors[2:258, 3:259] = 450.0
    return errors, np.array([(3, 2, 259, 258), (0, 0, 270, 260), (3, 2, 4, 3), (0, 0, 2, 2)])


def boxes_of(rng, shape, count=500):
    """Boxes of all sizes; the first one holds exactly the wall."""
    low = np.stack([rng.integers(0, n, count) for n in shape[::-1]], 1)
    size = np.exp(rng.uniform(0, np.log(60), (count, 2))).astype(int)
    found = np.concatenate([low, np.minimum(low + size, shape[::-1])], 1)
    found[0] = 5, 40, 261, 41
    found[1] = 0, 0, *shape[::-1]
    return found


def true_maximum(errors, boxes):
    """The largest error of each box."""
    return np.array([errors[y0:y1, x0:x1].max() for x0, y0, x1, y1 in boxes])


def rounded_up(errors, limits):
    """Each error, raised to the limit of its class."""
    return np.array([min([limit for limit in limits if limit >= e], default=SPAN_M) for e in errors])


@task("4.1 the limits", points=1)
def class_limits(student, rng):
    """Tested with 1 to 8 classes an octave."""
    for per_octave in (1, 2, 3, 4, 8):
        span_m = float(rng.uniform(10, 1000))
        want = true_limits(span_m, 20, per_octave)
        got = student.class_limits(span_m, 20, per_octave)
        yield compare(f"{per_octave} an octave", got, want, axes=("class",), rounding=1e-14)


@task("4.2 the class of an error", points=2)
def class_of(student, rng):
    """The limit of an error's class must not be below the error."""
    limits = true_limits(SPAN_M, CLASSES, PER_OCTAVE)
    errors = np.concatenate([SPAN_M * 2.0 ** -rng.uniform(0, 14, 400), limits, just_above(limits), [0.0, SPAN_M]])
    want = true_classes(errors, limits)
    got = student.class_of(errors, limits)
    yield compare("classes", got, want, axes=("error",))
    yield at_least(
        "limits are not below errors",
        np.append(SPAN_M, limits)[np.clip(got, -1, CLASSES - 1) + 1],
        errors,
        ("error",),
        rounding=0,
    )


@task("4.3 a table for each class", points=2)
def class_tables(student, rng):
    """The tables must count the cells above each limit."""
    errors, limits = errors_of(rng)
    want = true_tables(errors, limits)
    yield compare("counts", student.class_tables(errors, limits), want, axes=("class", "row", "column"))
    errors, _ = many_errors()
    want = true_tables(errors, np.array([400.0]))
    got = student.class_tables(errors, np.array([400.0]))
    yield compare("counts above 65,536", got, want, axes=("class", "row", "column"))


@task("4.4 the bound of a box", points=3)
def bound(student, rng):
    """Bounds must not be below the truth, and at most the width of a class above it."""
    errors, limits = errors_of(rng)
    boxes = boxes_of(rng, errors.shape)
    tables = student.class_tables(errors, limits)
    got = student.bound(tables, limits, SPAN_M, boxes)
    worst = true_maximum(errors, boxes)
    yield at_least("500 boxes: not below the largest error", got, worst, ("box",), rounding=0)
    yield compare("500 boxes: the limit of the class", got, rounded_up(worst, limits), axes=("box",), rounding=0)
    errors, boxes = many_errors()
    got = student.bound(student.class_tables(errors, limits[:3]), limits[:3], SPAN_M, boxes)
    worst = true_maximum(errors, boxes)
    yield at_least("65,536 cells above", got, worst, ("box",), rounding=0)
    yield compare("65,536 cells above: the limit of the class", got, rounded_up(worst, limits[:3]), axes=("box",))


@task("4.5 tiles", points=3)
def tiles(student, rng):
    """With tiles of 4 × 4 cells, bounds must still hold."""
    errors, limits = errors_of(rng)
    for tile in (2, 4):
        want = true_tiles(errors, tile)
        rows, cols = want.shape
        boxes = boxes_of(rng, errors.shape)
        tight = tight_boxes(boxes, tile)
        largest = student.tile_errors(errors, tile)
        yield compare(f"tiles of {tile}", largest, want, axes=("row", "column"), rounding=0)
        got = np.asarray(student.tile_boxes(boxes, tile))
        asked = np.clip(got, 0, [cols, rows, cols, rows]) if got.shape == boxes.shape else boxes
        narrow = np.array([[max(x1, x0 + 1), max(y1, y0 + 1)] for x0, y0, x1, y1 in asked])
        inside = true_maximum(want, np.concatenate([asked[:, :2], narrow], 1))
        yield at_least(
            f"tiles of {tile}: the widened box holds the largest error",
            inside,
            true_maximum(errors, boxes),
            ("box",),
            rounding=0,
        )
        yield compare(f"tiles of {tile}: boxes", got, tight, axes=("box", "side"))
        yield at_most(f"tiles of {tile}: no wider than needed", got[:, 2:], tight[:, 2:], ("box", "side"))
