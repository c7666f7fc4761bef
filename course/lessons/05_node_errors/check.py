"""Check of lesson 5: against the reference, and against points sampled on the drawn triangles."""

import numpy as np

from course.checking import at_least, compare, task
from course.land import land, spike
from course.truths import private
from terrain_gl import reference

TITLE = "Errors of nodes, nested bounds"


def map_of(rng):
    """A map with a spike; both sides of the map are multiples of 8 cells."""
    return spike(land(rng, 8 * int(rng.integers(4, 8)) + 1, 8 * int(rng.integers(4, 8)) + 1), rng)


@private
def true_quads(heights, level):
    """Largest error of each node's posts as a quad."""
    return np.maximum(*(np.abs(e).max((1, 3)) for e in reference.quad_errors(heights, level)))


@private
def true_fans(heights, level):
    """Largest error of each node's posts as a fan."""
    return np.abs(reference.fan_errors(heights, level)[0]).max((1, 3))


@private
def true_cells(heights):
    """Largest distance of each cell's triangles from the bilinear truth."""
    return np.abs(reference.twists(heights)) / 4


@private
def true_share(coarse, fine):
    """The share of nodes that are better than a child."""
    return float((coarse < reference.max_children(fine, coarse.shape)).mean())


@private
def true_bounds(errors):
    """The least nested bounds."""
    want = [errors[0]]
    for own in errors[1:]:
        want.append(np.maximum(own, reference.max_children(want[-1], own.shape)))
    return want


@task("5.1 the error of a quad", points=3)
def quad_errors(student, rng):
    """Both diagonals must count, and all posts: land, noise, and nodes of up to 16 cells."""
    for level in (1, 2, 3, 4):
        heights = map_of(rng) if level < 3 else rng.normal(0, 5, (49, 33))
        want = true_quads(heights, level)
        yield compare(f"level {level}", student.quad_errors(heights, level), want, axes=("row", "column"))


@task("5.2 the error of a fan", points=3)
def fan_errors(student, rng):
    """Tested at levels 1 and up, where the middle of a node is a post."""
    for level in (1, 2, 3):
        heights = map_of(rng)
        want = true_fans(heights, level)
        yield compare(f"level {level}", student.fan_errors(heights, level), want, axes=("row", "column"))


@task("5.3 between the posts", points=2)
def cell_errors(student, rng):
    """Errors must equal |t| / 4, and not be below errors that are sampled on the diagonals."""
    heights = map_of(rng)
    a, b, c, d = heights[:-1, :-1], heights[:-1, 1:], heights[1:, :-1], heights[1:, 1:]
    sampled = np.zeros(a.shape)
    for t in np.linspace(0, 1, 21):
        falling = a + (d - a) * t - (a * (1 - t) ** 2 + (b + c) * t * (1 - t) + d * t * t)
        rising = b + (c - b) * t - (b * (1 - t) ** 2 + (a + d) * t * (1 - t) + c * t * t)
        sampled = np.maximum(sampled, np.maximum(np.abs(falling), np.abs(rising)))
    want = true_cells(heights)
    got = student.cell_errors(heights)
    yield at_least("no sampled place is farther off", got, sampled, ("row", "column"))
    yield compare("the largest distance", got, want, axes=("row", "column"))


@task("5.4 errors are not nested", points=1)
def share_below(student, rng):
    """Tested on land, on noise, and on a plain, where a node is as good as its children."""
    plain = spike(np.zeros((33, 33)), rng)
    for name, heights in (("land", map_of(rng)), ("noise", rng.normal(0, 5, (33, 41))), ("a plain", plain)):
        fine, coarse = true_quads(heights, 1), true_quads(heights, 2)
        want = true_share(coarse, fine)
        yield compare(name, student.share_below(coarse, fine), want)


@task("5.5 bounds are nested", points=3)
def nested(student, rng):
    """Tested over four levels: bounds must be nested, and no larger than necessary."""
    rows, cols = 65, 16 * int(rng.integers(5, 8)) + 1
    heights = land(rng, rows, cols) + rng.normal(0, 20, (rows, cols))
    errors = [
        true_cells(heights),
        *(true_quads(heights, level) * rng.uniform(0.3, 1) for level in (1, 2, 3, 4)),
    ]
    want = true_bounds(errors)
    got = student.nested(errors)
    for level, (found, bound) in enumerate(zip(got, want, strict=True)):
        yield at_least(f"level {level}: not below a descendant", found, bound, ("row", "column"))
        yield compare(f"level {level}: the least such bound", found, bound, axes=("row", "column"))
