"""The error of meshes is exact: compared with a search in rational numbers, piece by piece."""

from fractions import Fraction

import numpy as np
import pytest

from terrain_gl.verify.check import check_mesh

# --- The same in rational numbers, slowly -----------------------------------------------------------------------------


def clipped(polygon, axis, line, sign):
    """The part of a convex polygon with sign · coordinate >= sign · line (Sutherland and Hodgman 1974)."""
    kept = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        side_a, side_b = sign * (a[axis] - line), sign * (b[axis] - line)
        if side_a >= 0:
            kept.append(a)
        if (side_a > 0 > side_b) or (side_a < 0 < side_b):
            t = side_a / (side_a - side_b)
            kept.append(tuple(p + t * (q - p) for p, q in zip(a, b, strict=True)))
    return kept


def integral(f, a, b, c):
    """Of a polynomial of degree up to 5 over a triangle: the rule of Grundmann and Moeller (1978), s = 2."""
    total = Fraction(0)
    for i in range(3):
        n = 7 - 2 * i
        weight = Fraction((-1) ** i * n**5, 16 * [1, 1, 2][i] * [5040, 720, 120][i])
        for p in range(3 - i):
            for q in range(3 - i - p):
                r = 2 - i - p - q
                shares = [Fraction(2 * k + 1, n) for k in (p, q, r)]
                x, y = (sum(s * at[k] for s, at in zip(shares, (a, b, c), strict=True)) for k in (0, 1))
                total += weight * f(x, y)
    return total * abs((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]))


def searched(heights, triangles):
    """Largest error over the surface, its mean square, the area, and the errors of posts; all rational."""
    rows, cols = heights.shape
    h = [[None if np.isnan(v) else Fraction(float(v)) for v in row] for row in heights]
    largest, squares, area = Fraction(0), Fraction(0), Fraction(0)
    of_posts = {}
    for triangle in triangles:
        a, b, c = ([Fraction(float(v)) for v in corner] for corner in triangle)
        doubled = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if not doubled:
            continue
        east = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / doubled
        south = ((b[0] - a[0]) * (c[2] - a[2]) - (c[0] - a[0]) * (b[2] - a[2])) / doubled

        def top(x, y, a=a, east=east, south=south):
            return a[2] + east * (x - a[0]) + south * (y - a[1])

        for row, col in np.ndindex(rows, cols):
            sides = [(q[0] - p[0]) * (row - p[1]) - (q[1] - p[1]) * (col - p[0]) for p, q in ((a, b), (b, c), (c, a))]
            if min(s * doubled for s in sides) >= 0 and h[row][col] is not None:
                error = abs(h[row][col] - top(col, row))
                of_posts[row, col] = max(of_posts.get((row, col), 0), error)
                largest = max(largest, error)
        for row, col in np.ndindex(rows - 1, cols - 1):
            corners = h[row][col], h[row][col + 1], h[row + 1][col], h[row + 1][col + 1]
            if None in corners:
                continue
            part = [tuple(p[:2]) for p in (a, b, c)]
            for axis, line, sign in ((0, col, 1), (0, col + 1, -1), (1, row, 1), (1, row + 1, -1)):
                part = clipped(part, axis, line, sign)

            def error(x, y, row=row, col=col, corners=corners, top=top):
                u, v = x - col, y - row
                nw, ne, sw, se = corners
                return (nw * (1 - u) + ne * u) * (1 - v) + (sw * (1 - u) + se * u) * v - top(x, y)

            for p, q in zip(part, part[1:] + part[:1], strict=True):
                low, middle, high = (error(*(x + s * (y - x) for x, y in zip(p, q, strict=True))) for s in HALVES)
                bend = 2 * (low - 2 * middle + high)  # of the parabola low + (high - low) s + bend s (s - 1)
                s = HALVES[1] - (high - low) / (2 * bend) if bend else 0
                s = s if 0 < s < 1 else 0
                largest = max(largest, abs(low), abs(high), abs(low + (high - low) * s + bend * s * (s - 1)))
            for p, q in zip(part[1:], part[2:], strict=False):
                squares += integral(lambda x, y, error=error: error(x, y) ** 2, part[0], p, q)
                area += integral(lambda x, y: Fraction(1), part[0], p, q)
    return largest, squares, area, of_posts


HALVES = Fraction(0), Fraction(1, 2), Fraction(1)


def small_mesh(rng):
    """A map and a mesh of a coarser grid over it: shifted, poked, turned, with holes, and beyond the map's rim."""
    rows, cols = rng.integers(2, 7, 2)
    heights = rng.normal(0, 10, (rows, cols)).astype("f4")
    if rng.random() < 0.4:
        heights[rng.random(heights.shape) < 0.15] = np.nan
    n, m = rng.integers(2, 5, 2)
    y, x = np.meshgrid(np.linspace(0, rows - 1, n), np.linspace(0, cols - 1, m), indexing="ij")
    posts = np.stack([x, y], -1).reshape(-1, 2)
    kind = rng.integers(4)
    if kind == 0:
        posts = np.rint(posts)  # vertices on posts; equal ones make triangles without an area
    elif kind == 1:
        posts += rng.normal(0, 0.15, posts.shape)
    elif kind == 2:
        posts = posts @ np.array([[0.8, 0.6], [-0.6, 0.8]]) + rng.uniform(-1, 1, 2)
    number = np.arange(n * m).reshape(n, m)
    a, b, c, d = (number[i : n - 1 + i, j : m - 1 + j].ravel() for i in (0, 1) for j in (0, 1))
    faces = np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)])
    faces = faces[rng.random(len(faces)) < 0.85]
    return heights, posts, rng.normal(0, 10, len(posts)), faces


@pytest.mark.parametrize("seed", range(20))
def test_errors_are_those_of_rational_numbers(seed):
    rng = np.random.default_rng(seed)
    for _ in range(10):
        heights, posts, tops_m, faces = small_mesh(rng)
        found = check_mesh(heights, posts, tops_m, faces)
        largest, squares, area, of_posts = searched(heights, np.column_stack([posts, tops_m])[faces])
        assert found.surface == pytest.approx(float(largest), abs=1e-9)
        assert found.surface_rms**2 * float(area) == pytest.approx(float(squares), abs=1e-9, rel=1e-9)
        assert {(int(r), int(c)) for r, c in np.argwhere(~np.isnan(found.of_posts))} == set(of_posts)
        for post, error in of_posts.items():
            assert found.of_posts[post] == pytest.approx(float(error), abs=1e-9)
        cells = np.isfinite(heights[:-1, :-1] + heights[:-1, 1:] + heights[1:, :-1] + heights[1:, 1:]).sum()
        assert found.covered + found.overlap == pytest.approx(float(area) / max(cells, 1), abs=1e-9)
