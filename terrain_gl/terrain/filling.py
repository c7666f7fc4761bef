"""Fill voids with a smooth surface through their rim."""

import numpy as np

from ..basics.rect import Rect, hull

SWEEPS = 6  # relaxation sweeps at each level; more sweeps make no visible difference


def fill_voids(heights: np.ndarray) -> np.ndarray:
    """Heights with NaN replaced by a smooth surface through the rim of the voids."""
    return Filling(heights).filled[0] if np.isnan(heights).any() else heights


class Filling:
    """Heights with voids filled. An edit computes only the part that depends on it.

    Pull-push (Gortler et al. 1996, "The lumigraph") gives a first guess at each level. Pull: each coarser level is half
    as large, and its posts are the means of the known posts below. Push: from the coarsest level down, void posts take
    heights from the level above. Then relax: a few times, each void post becomes the mean of its four neighbours. All
    levels together approximate the harmonic surface, a membrane that is fixed at the rim of the voids (Bornemann and
    Deuflhard 1996, "The cascadic multigrid method for elliptic problems").

        known   5 ·     pull    5        push    5 5     relax
                · ·      →                →      5 5

    Attributes
    ----------
    known, filled
        All levels, from the map itself, (rows, cols), up to a single post. `known` has NaN at voids.
    """

    def __init__(self, heights: np.ndarray) -> None:
        self.known = [heights]
        while self.known[-1].size > 1:
            self.known.append(pull(self.known[-1]))
        self.filled = [self.known[-1]]
        for known in self.known[-2::-1]:
            self.filled.insert(0, push(known, self.filled[0], _all_of(known)))

    def update(self, posts: Rect) -> Rect:
        """Follow new heights in a rectangle (x0, y0, x1, y1); returns the rectangle in which `filled` changes."""
        rects = [posts]
        for below, known in zip(self.known, self.known[1:], strict=False):
            x0, y0, x1, y1 = (i // 2 for i in rects[-1])
            known[y0 : y1 + 1, x0 : x1 + 1] = pull(below[2 * y0 : 2 * y1 + 2, 2 * x0 : 2 * x1 + 2])
            rects.append((x0, y0, x1, y1))
        self.filled[-1] = self.known[-1]
        changed = rects[-1]
        for level in range(len(self.known) - 2, -1, -1):
            changed = self._push_again(level, rects[level], changed)
        return changed

    def _push_again(self, level: int, posts: Rect, above: Rect) -> Rect:
        """Fill a level again around changes in it and in the coarser level; returns the hull of `posts` and changes."""
        known = self.known[level]
        filled = self.filled[level]
        below = 2 * above[0] - 1, 2 * above[1] - 1, 2 * above[2] + 2, 2 * above[3] + 2
        around = _grown(hull(posts, below), SWEEPS, known)
        x0, y0, x1, y1 = around
        old = filled[y0 : y1 + 1, x0 : x1 + 1]
        new = push(known, self.filled[level + 1], around)
        differs = new != old
        old[...] = new
        at_y = np.flatnonzero(differs.any(1)) + y0
        at_x = np.flatnonzero(differs.any(0)) + x0
        if not len(at_y):
            return posts
        return hull(posts, (int(at_x[0]), int(at_y[0]), int(at_x[-1]), int(at_y[-1])))


def _all_of(heights: np.ndarray) -> Rect:
    return 0, 0, heights.shape[1] - 1, heights.shape[0] - 1


def _grown(rect: Rect, by: int, within: np.ndarray) -> Rect:
    """A rectangle with `by` more posts on each side, cut at the rim of the level."""
    x0, y0, x1, y1 = rect
    return max(x0 - by, 0), max(y0 - by, 0), min(x1 + by, within.shape[1] - 1), min(y1 + by, within.shape[0] - 1)


def push(known: np.ndarray, above: np.ndarray, rect: Rect) -> np.ndarray:
    """Fill the voids of a rectangle of a level from the level above, and relax them.

    The result is that of the whole level: a sweep reads one post on each side, so `SWEEPS` posts around the rectangle
    are also filled, and left out of the result. `known` may be a part of a level. Then `above` is a part of the level
    above: its first post has half the column and row, and it covers the grown rectangle.
    """
    x0, y0, x1, y1 = _grown(rect, SWEEPS, known)
    part = known[y0 : y1 + 1, x0 : x1 + 1]
    void = np.isnan(part)
    inner = np.s_[rect[1] - y0 : rect[3] - y0 + 1, rect[0] - x0 : rect[2] - x0 + 1]
    if not void.any():
        return part[inner].copy()
    rows, cols = np.flatnonzero(void.any(1)), np.flatnonzero(void.any(0))
    box = np.s_[max(rows[0] - 1, 0) : rows[-1] + 2, max(cols[0] - 1, 0) : cols[-1] + 2]
    filled = part.astype(np.float32)
    some = filled[box]
    hole = void[box]
    first = y0 + box[0].start, x0 + box[1].start
    some[hole] = _surface(above, first, some.shape)[hole]
    for _ in range(SWEEPS):
        around = np.pad(some, 1, "edge")
        mean = (around[:-2, 1:-1] + around[2:, 1:-1]) + (around[1:-1, :-2] + around[1:-1, 2:])
        some[hole] = (np.float32(0.25) * mean)[hole]
    return filled[inner]


def _surface(above: np.ndarray, first: tuple[int, int], shape: tuple[int, ...]) -> np.ndarray:
    """Bilinear heights of the level above, at the posts of the level below."""
    values = above
    for axis in (0, 1):
        i = np.arange(first[axis], first[axis] + shape[axis])
        near = i // 2  # a post of the level above is in the middle of 2 × 2 posts
        next_ = np.clip(near + np.where(i % 2, 1, -1), 0, above.shape[axis] - 1)
        a, b = values.take(near, axis), values.take(next_, axis)
        values = a + np.float32(0.25) * (b - a)
    return values


def pull(heights: np.ndarray) -> np.ndarray:
    """Halve a map: the mean of the known heights in each block of 2 × 2 posts."""
    rows, cols = heights.shape
    padded = np.pad(heights, ((0, rows % 2), (0, cols % 2)), constant_values=np.nan)
    blocks = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2)
    known = np.isfinite(blocks).sum((1, 3))
    total = np.nansum(blocks, (1, 3), dtype=np.float64)
    return np.where(known > 0, total / np.maximum(known, 1), np.nan).astype(np.float32)
