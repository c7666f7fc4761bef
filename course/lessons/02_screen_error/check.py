"""Check of lesson 2: the truth is two projections of each point, before it moves and after."""

import itertools

import numpy as np

from course.checking import at_least, at_most, compare, task
from course.truths import private
from terrain_gl import reference

TITLE = "Screen-space error"
POINTS = 2000


def view(rng, looks=-1, turns=1.0):
    """Axes of a camera that looks down a little, or up, and rolls; its focal length and the extent of its picture.

    It looks less than `turns` off the north: a full turn is 1.
    """
    pitch, azimuth = looks * rng.uniform(0.2, 0.7), turns * rng.uniform(0, 2 * np.pi)
    forward = np.array([np.cos(pitch) * np.sin(azimuth), np.cos(pitch) * np.cos(azimuth), np.sin(pitch)])
    right = np.array([np.cos(azimuth), -np.sin(azimuth), 0])
    up, roll = np.cross(right, forward), rng.uniform(-1.2, 1.2)
    axes = np.stack([np.cos(roll) * right + np.sin(roll) * up, np.cos(roll) * up - np.sin(roll) * right, forward])
    height = int(rng.integers(400, 1100))
    tan_y = np.tan(np.radians(30))
    return axes, height / (2 * tan_y), (tan_y * 16 / 9, tan_y)


def points(rng, extent, count=POINTS):
    """Points in the picture, its four corners among them, (3, count)."""
    x, y = rng.uniform(-1, 1, (2, count))
    x[:4], y[:4] = [-1, 1, -1, 1], [-1, -1, 1, 1]
    z = rng.uniform(50, 3000, count)
    return np.stack([x * extent[0] * z, y * extent[1] * z, z])


@private
def moved_px(p, v, focal_px, rise_m):
    """Distance in pixels between the places of a point on the screen, before and after its move."""
    after = p + v.reshape(3, *[1] * (p.ndim - 1)) * rise_m
    return focal_px * np.hypot(*(after[:2] / after[2] - p[:2] / p[2]))


@private
def true_tolerance(p, v, focal_px, error_px):
    """The rise that moves a point by the error in the worse direction, by bisection."""
    low, high = np.zeros(POINTS), p[2] / (abs(v[2]) + 1e-9) * (1 - 1e-12)
    for _ in range(80):
        middle = 0.5 * (low + high)
        fits = np.maximum(*(moved_px(p, v, focal_px, sign * middle) for sign in (-1, 1))) <= error_px
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    return low


@private
def most_moved(samples, v, focal_px, error_m):
    """The largest move of these points, for rises up to an error."""
    return max(float(moved_px(samples, v, focal_px, share * error_m).max()) for share in (-1, -0.5, 0.5, 1))


@private
def projected(axes, focal_px, extent, low, high):
    """Whether the picture shows a box, and its least depth."""
    found = reference.project_boxes(reference.Pinhole(np.zeros(3), axes, focal_px, extent, 1.0), low, high)
    return bool(found.inside), float(found.nearest_m)


@private
def true_bound(axes, focal_px, extent, low, high, error_m):
    """The bound of a box."""
    picture, error_m = reference.Pinhole(np.zeros(3), axes, focal_px, extent, 1.0), np.array(error_m)
    return float(reference.error_px(picture, reference.project_boxes(picture, low, high), error_m, error_m))


@task("2.1 the shift of a point", points=3)
def shift(student, rng):
    """Tested at points everywhere in the picture, with small and large shifts."""
    axes, focal_px, extent = view(rng)
    p, v = points(rng, extent), axes[:, 2]
    for name, largest in (("shifts of a metre", 1.0), ("shifts up to a third of the depth", 0.33 * p[2])):
        rise_m = rng.uniform(-1, 1, POINTS) * largest
        want = moved_px(p, v, focal_px, rise_m)
        yield compare(name, student.shift_px(p, v, focal_px, rise_m), want, 1e-3 * want.max(), ("point",))
    level = np.array([0.0, 1.0, 0.0])
    rise_m = rng.uniform(1, 5, POINTS)
    want = moved_px(p, level, focal_px, rise_m)
    yield compare("a level camera", student.shift_px(p, level, focal_px, rise_m), want, 1e-3 * want.max(), ("point",))


@task("2.2 the tolerance in metres", points=3)
def tolerance(student, rng):
    """In the worse direction, δ must move the point by exactly the allowed error."""
    for looks, error_px in ((-1, 0.5), (-1, 40.0), (1, 40.0)):
        axes, focal_px, extent = view(rng, looks)
        p, v = points(rng, extent), axes[:, 2]
        low = true_tolerance(p, v, focal_px, error_px)
        got = student.tolerance_m(p, v, focal_px, error_px)
        title = f"{error_px:g} pixels, a camera that looks {'up' if looks > 0 else 'down'}"
        yield compare(title, got, low, 1e-3 * low.max(), ("point",))
        yield at_most(f"{title}: no point may move farther", got, low, ("point",))


@task("2.3 the bound of a box", points=4)
def bound(student, rng):
    """No sampled point may move farther than the bound, and the bound must be as tight as the corners allow."""
    for looks in (-1, 1):
        yield from bounds_of(student, rng, looks)
    yield from bounds_of(student, rng, -1, turns=0.01)


def bounds_of(student, rng, looks, turns=1.0):
    """Test bounds of small and large boxes. If the camera looks north, pairs of corners have nearly the same depth."""
    name = f"a camera that looks {'up' if looks > 0 else 'down'}{', north' if turns < 1 else ''}"
    axes, focal_px, extent = view(rng, looks, turns)
    v, bounds, worst, tight = axes[:, 2], [], [], []
    while len(bounds) < 60:
        middle = axes.T @ (points(rng, extent, 5)[:, 4] * rng.uniform(0.3, 1))
        size = 0.6 * 10 ** rng.uniform(-1.5, 0, 3) * np.linalg.norm(middle)
        low, high = middle - size / 2, middle + size / 2
        inside, nearest_m = projected(axes, focal_px, extent, low, high)
        error_m = float(rng.uniform(0.001, 0.3) * nearest_m)
        if not inside:
            continue
        corners = axes @ np.array(list(itertools.product(*zip(low, high, strict=True)))).T
        inside = axes @ rng.uniform(low, high, (400, 3)).T
        samples = np.concatenate([corners, inside], 1)
        worst.append(most_moved(samples, v, focal_px, error_m))
        tight.append(true_bound(axes, focal_px, extent, low, high, error_m))
        bounds.append(student.bound_px(corners, v, focal_px, error_m))
    yield at_least(f"{name}: no point of the box moves farther", bounds, worst, ("box",))
    yield at_most(f"{name}: the bound is tight", bounds, (1 + 1e-9) * np.array(tight), ("box",))
