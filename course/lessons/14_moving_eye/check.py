"""Check of lesson 14: surfaces post by post, and flights whose every frame is within the error."""

import numpy as np

from course.checking import at_most, compare, holds, task
from course.land import land, spike
from course.truths import private

TITLE = "A moving eye"
FOCAL_PX = 400.0
FLOAT32 = 1e-6  # relative: heights may be float32


def ends(n, y, x):
    """The two ends of the longest side whose middle is the post (y, x); None for a corner of the map."""
    side = n - 1
    while side > 1:
        half = side // 2
        if y % side == half and x % side == half:
            return ((y - half, x - half), (y + half, x + half)) if (y // side + x // side) % 2 == 0 else (
                (y - half, x + half), (y + half, x - half))  # fmt: skip
        if y % side == 0 and x % side == half:
            return (y, x - half), (y, x + half)
        if y % side == half and x % side == 0:
            return (y - half, x), (y + half, x)
        side = half
    return None


@private
def true_surface(heights, active):
    """Drawn heights, post by post."""
    n, known = len(heights), {}

    def drawn(y, x):
        if (y, x) not in known:
            pair = ends(n, y, x)
            known[y, x] = heights[y, x] if pair is None or active[y, x] else sum(drawn(*end) for end in pair) / 2
        return known[y, x]

    return np.array([[drawn(y, x) for x in range(n)] for y in range(n)])


@private
def bounds_m(heights):
    """For each post the sum of the errors of middles, down to the worst post inside."""
    n, found = len(heights), np.zeros(heights.shape)
    for y, x in sorted(np.ndindex(n, n), key=lambda at: _length(n, *at)):  # the finest first
        pair = ends(n, y, x)
        if pair is None:
            continue
        found[y, x] += abs(heights[y, x] - (heights[pair[0]] + heights[pair[1]]) / 2)
        dy, dx = pair[1][0] - y, pair[1][1] - x
        for row, col in ((y + dx, x - dy), (y - dx, x + dy)):
            if 0 <= row < n and 0 <= col < n:
                found[row, col] = max(found[row, col], found[y, x])
    found[:: n - 1, :: n - 1] = 0
    return found


def _length(n, y, x):
    """The squared length of half the side that a post is the middle of; corners of the map come last."""
    pair = ends(n, y, x)
    return 2 * n * n if pair is None else (pair[1][0] - y) ** 2 + (pair[1][1] - x) ** 2


def flight(rng, frames, drop=0):
    """A map, bounds in pixels, pixels of a metre at each post. In the frame `drop` the eye sinks below the spike."""
    plain, spacing_m = land(rng, 33, 33), float(rng.uniform(20, 40))
    heights = spike(plain, rng)
    start, end = rng.uniform(0, 0.3, 2), rng.uniform(0.6, 1, 2)
    t = np.linspace(0, 1, frames)[:, None]
    up = heights.max() + 120.0 + np.where(np.arange(frames) < drop, 2000.0, 0.0)
    if drop:
        up[drop:] = plain.max() + rng.uniform(20, 60)
    eyes = np.column_stack([(start + t * (end - start)) * 32 * spacing_m, up])
    metres, (y, x) = bounds_m(heights), np.indices(heights.shape) * spacing_m
    radius = np.zeros(heights.shape)
    for at in np.ndindex(*heights.shape):
        pair = ends(33, *at)
        radius[at] = 0 if pair is None else 2.42 * spacing_m * np.hypot(pair[1][0] - at[0], pair[1][1] - at[1])
    away = np.array([np.hypot(x - eye[0], y - eye[1]) for eye in eyes])
    over = np.maximum(np.maximum(up - heights.max(), heights.min() - up), 0)[:, None, None]
    nearest = np.maximum(np.hypot(np.maximum(away - radius, 0), over), 1e-9)  # the eye may be among the land
    return heights, FOCAL_PX * metres / nearest, FOCAL_PX / np.hypot(away, up[:, None, None] - heights)


@task("14.1 the drawn surface", points=3)
def surface(student, rng):
    """Tested with meshes of the flight, with no post, with all posts, and with posts at random."""
    heights, px, _ = flight(rng, 3)
    cases = {f"{error:.3g} px": px[1] > error for error in np.quantile(px[1], (0.3, 0.8))}
    cases |= {"no post": np.zeros(heights.shape, bool), "all posts": np.ones(heights.shape, bool)}
    for name, active in {**cases, "at random": rng.random(heights.shape) < 0.5}.items():
        want = true_surface(heights, active)
        yield compare(name, student.surface(heights, active), want, axes=("row", "column"), rounding=FLOAT32)


@task("14.2 a jump", points=1)
def jump(student, rng):
    """Posts that fall count as posts that rise, and near ones more than far ones."""
    for sign in (-1, 1):
        before, scale = rng.normal(0, 1, (9, 9)), rng.uniform(0.1, 1, (9, 9))
        after, place = before + rng.uniform(-1, 1, (9, 9)), tuple(rng.integers(0, 9, 2))
        after[place], scale[place] = before[place] + 3.0 * sign, 0.9
        far = (place[0] + 4) % 9, place[1]
        after[far], scale[far] = before[far] + 20.0, 0.01
        want = float(np.max(np.abs((after - before) * scale)))
        yield compare("up" if sign > 0 else "down", student.jump_px(before, after, scale), want)


@private
def kept(active, px, error_px, share):
    """Active posts with hysteresis, post by post."""
    found = np.zeros(px.shape, bool)
    for at in np.ndindex(*px.shape):
        found[at] = px[at] > (share * error_px if active[at] else error_px)
    return found


@task("14.3 hysteresis", points=2)
def still(student, rng):
    """Tested over a flight. A post whose bound is exactly the error is not needed."""
    heights, px, _ = flight(rng, 12)
    error_px = float(px[3].ravel()[np.argsort(px[3].ravel())[-200]])
    for share in (0.5, float(rng.uniform(0.2, 0.9)), 1.0):
        active = np.zeros(heights.shape, bool)
        for frame, each in enumerate(px.copy()):
            each[10, 10:12] = error_px, share * error_px if frame else 2 * error_px  # exactly at the limits
            want = kept(active, each, error_px, share)
            got = student.still(active, each, error_px, share)
            yield compare(f"frame {frame}", np.asarray(got).astype(int), want.astype(int), axes=("row", "column"))
            active = want


@private
def true_keys(px, error_px, period):
    """The active posts of each key, frame by frame."""
    count = 1
    while (count - 1) * period < len(px) - 1:
        count += 1
    found = np.zeros((count, *px.shape[1:]), bool)
    for frame, each in enumerate(px):
        for i in range(count):
            holds_here = (i - 1) * period < frame <= (i + 1) * period
            found[i] |= holds_here & (each > error_px)
    return found


def periods(rng):
    """Frames and periods: whole numbers of periods, others, and a single key."""
    return [(17, 8), (int(rng.integers(12, 20)), int(rng.integers(3, 7))), (9, 1), (5, 6), (1, 4)]


@task("14.4 keys that hold", points=2)
def keys(student, rng):
    """A key must hold in every frame in which it is drawn, and have no other posts."""
    for frames, period in periods(rng):
        _, px, _ = flight(rng, frames, drop=period)
        error_px = float(np.quantile(px, 0.7))
        want = true_keys(px, error_px, period)
        got = np.asarray(student.held(px, error_px, period))
        name = f"{frames} frames, a key each {period}"
        yield holds(f"{name}: the kind", got.dtype == bool, f"expected bool, got {got.dtype}")
        yield compare(name, got.astype(int), want.astype(int), axes=("key", "row", "column"))


@private
def true_flight(heights, keys, frames, period):
    """The blended surfaces, frame by frame."""
    surfaces = [true_surface(heights, active) for active in keys]
    found = []
    for frame in range(frames):
        weights = [max(0.0, 1 - abs(frame - i * period) / period) for i in range(len(surfaces))]
        found.append(sum(w * each for w, each in zip(weights, surfaces, strict=True)))
    return np.array(found)


@task("14.5 fly", points=2)
def fly(student, rng):
    """Every frame must be within the error, and no jump above twice the error, divided by the period."""
    for frames, period in periods(rng):
        heights, px, scale = flight(rng, frames, drop=period)
        error_px = float(np.quantile(px, 0.7))
        want = true_flight(heights, true_keys(px, error_px, period), frames, period)
        got = np.asarray(student.fly(heights, px, error_px, period))
        name, axes = f"{frames} frames, a key each {period}", ("frame", "row", "column")
        if got.shape == want.shape:
            off = np.abs(got - heights) * scale
            room = FLOAT32 * heights.max() * scale
            yield at_most(f"{name}: the error", off, error_px + room, axes)
            jumps = np.abs(np.diff(got, axis=0)) * scale[1:]
            yield at_most(f"{name}: jumps", jumps, 2 * error_px / period + room[1:], ("step from frame", *axes[1:]))
        yield compare(name, got, want, axes=axes, rounding=FLOAT32)
