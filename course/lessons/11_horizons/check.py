"""Check of lesson 11: against every pair of posts, with times relative to a loop of plain Python."""

import time

import numpy as np

from course.checking import compare, holds, task
from course.land import land
from course.truths import private

TITLE = "Horizons"


def line(rng, n):
    """Heights along a line: a walk with plains and steps."""
    return np.cumsum(rng.normal(0, 3, n) * (rng.random(n) < 0.7)) + 50 * (rng.random(n) < 0.01)


@private
def pairs(heights, step_m):
    """Horizons by all pairs."""
    n = len(heights)
    slope = (heights - heights[:, None]) / (step_m * np.maximum(np.arange(n) - np.arange(n)[:, None], 1))
    return np.where(np.arange(n) > np.arange(n)[:, None], slope, -np.inf).max(1)


def seconds(action):
    """Time of an action."""
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def loop(n):
    """Run a loop of plain Python, whose steps take about as long as steps of a sweep."""
    values, stack = list(range(n)), []
    for i in range(n - 1, -1, -1):
        while len(stack) > 1 and (values[stack[-1]] - i) * (stack[-2] - i) < -1:
            stack.pop()
        stack.append(i)


@task("11.1 by every pair", points=2)
def slow_horizons(student, rng):
    """Tested on rising, falling and rough lines."""
    for name, heights in lines(rng).items():
        step_m = float(rng.uniform(2, 40))
        want = pairs(heights, step_m)
        yield compare(name, student.slow_horizons(heights, step_m), want, axes=("post",))


def lines(rng):
    """Lines of all kinds."""
    n = int(rng.integers(80, 200))
    return {
        "a rough line": line(rng, n),
        "a dune": 40 * np.sin(np.linspace(0, np.pi, n)),
        "a bowl": -40 * np.sin(np.linspace(0, np.pi, n)),
        "a straight slope": 3.0 * np.arange(n),
        "a single post": np.array([5.0]),
    }


@task("11.2 by a sweep", points=4)
def horizons(student, rng):
    """Horizons must equal those of all pairs, in a time that grows as the line does."""
    for name, heights in lines(rng).items():
        step_m = float(rng.uniform(2, 40))
        want = pairs(heights, step_m)
        yield compare(name, student.horizons(heights, step_m), want, axes=("post",))
    n = 60_000
    heights = np.concatenate([line(rng, n // 2), -(np.arange(n // 2) ** 1.5)])  # a dune: a hull that is never cut
    allowed = 1.5 + 12 * seconds(lambda: loop(n))
    start = time.perf_counter()
    got = student.horizons(heights, 7.5)
    took = time.perf_counter() - start
    some = rng.integers(0, n - 1, 50)
    want = [((heights[i + 1 :] - heights[i]) / (7.5 * np.arange(1, n - i))).max() for i in some]
    found = np.asarray(got, float)
    yield compare(f"{n:,} posts: 50 of them", found[some] if found.shape == (n,) else found, want, axes=("post",))
    yield holds(
        f"{n:,} posts", took <= allowed, f"{took:.1f} s; a sweep of this machine takes less than {allowed:.1f} s"
    )


@task("11.3 a map", points=3)
def map_horizons(student, rng):
    """Tested in four directions, with unequal spacings."""
    rows, cols = (int(v) for v in rng.integers(20, 40, 2))
    heights, (s, t) = land(rng, rows, cols), rng.uniform(5, 40, 2)
    east = np.array([pairs(row, s) for row in heights])
    west = np.array([pairs(row[::-1], s)[::-1] for row in heights])
    south = np.array([pairs(col, t) for col in heights.T]).T
    north = np.array([pairs(col[::-1], t)[::-1] for col in heights.T]).T
    got = np.asarray(student.map_horizons(heights, (s, t)))
    want = {"west": west, "north": north, "east": east, "south": south}
    if got.shape != (4, rows, cols):
        yield holds("shape", False, f"expected the shape {(4, rows, cols)}, got {got.shape}")
        return
    for found, (name, slopes) in zip(got, want.items(), strict=True):
        yield compare(f"towards {name}", found, slopes, axes=("row", "column"))


@private
def true_shares(elevation, horizon, radius):
    """The share of a disc above each horizon, strip by strip."""
    y = -1 + (np.arange(400_000) + 0.5) / 200_000
    area = np.sqrt(1 - y * y)
    return np.array([area[y > (each - elevation) / radius].sum() / area.sum() for each in horizon])


@task("11.4 the sun's disc", points=2)
def disc_share(student, rng):
    """Compared with the area of a disc, summed strip by strip."""
    radius = float(rng.uniform(0.003, 0.02))
    elevation = rng.uniform(0.1, 0.5)
    horizon = elevation + radius * np.linspace(-1.5, 1.5, 61)
    want = true_shares(elevation, horizon, radius)
    got = np.asarray(student.disc_share(elevation, horizon, radius), float)
    fits = got.shape == want.shape and bool((np.abs(got - want) < 1e-5).all())
    yield compare("share of the disc", want if fits else got, want, axes=("horizon",))


@task("11.5 light and shadow", points=1)
def sunlit(student, rng):
    """A post with only sky ahead must be in the light."""
    slopes = np.append(rng.normal(0, 0.3, 200), [-np.inf, -np.inf])
    tangent = float(rng.uniform(0.05, 0.4))
    yield compare(
        "who sees the sun",
        np.asarray(student.sunlit(slopes, tangent)).astype(int),
        (slopes < tangent).astype(int),
        axes=("post",),
    )
