"""Wider bounds for nodes with edited posts. They are valid at once, and are used until the records are computed anew.

Let all posts of a closed node change by at most t metres, and its possible vertices, the posts of its four edges, by at
most v. Every mesh in the node then moves by at most v, because each of its places is a weighted mean of
vertices. The truth moves by at most t. So the largest error grows by at most s = t + v.

    max' = max + s        rms'² = (rms + 5/2 s)² + 2^(1−level) max t, and at most max'²

The proof is in docs/guarantee.md, section 9. Specification: `reference.node_moves`, `reference.widened_errors`.
"""

from typing import NamedTuple

import numpy as np

from ..gpu.packing import ERROR_UNIT, pack_pair, unpack_pair

ROUNDED = 1 + 2.0**-15  # factor that covers rounding errors of float32


class Scale(NamedTuple):
    """A quantisation range: its lowest height and its width in metres."""

    low_m: float
    span_m: float


class Moves(NamedTuple):
    """How far the posts of nodes have moved: (rows, cols) of each."""

    truth: np.ndarray  # the largest move of the node's posts, in metres
    vertices: np.ndarray  # the largest move of its possible vertices
    low: np.ndarray  # the lowest new height; inf if no post of the node has one
    high: np.ndarray  # the highest new height; −inf if no post of the node has one


Span = tuple[int, int]  # the first node, and the node after the last one


def touched(first: int, end: int, level: int, last: int) -> Span:
    """Closed nodes that have posts from `first` to `end` − 1, along one axis; `last` is the map's last post."""
    nodes = -(-last >> level)
    return max(0, first - 1) >> level, min((end - 1) >> level, nodes - 1) + 1


def moves(old: np.ndarray, new: np.ndarray, at: tuple[int, int], level: int, last: tuple[int, int]) -> Moves:
    """How far an edit moves the posts of each node that it touches, for one level.

    The heights `old` and `new` are those of a rectangle of posts. `at` and `last` are row and column of its first post,
    and of the map's last post.
    """
    moved = np.abs(new.astype(np.float64) - old)
    spans = [touched(at[i], at[i] + old.shape[i], level, last[i]) for i in (0, 1)]
    rows, cols = ([_inside(node, at[i], level, last[i]) for node in range(*spans[i])] for i in (0, 1))
    lines = [_lines(moved, spans[i], at[i], level, last[i], i) for i in (0, 1)]
    along_row = _of(np.maximum, lines[0], cols, 1)
    along_col = _of(np.maximum, lines[1], rows, 0)
    vertices = np.maximum.reduce([along_row[:-1], along_row[1:], along_col[:, :-1], along_col[:, 1:]])
    changed = moved > 0
    return Moves(
        _of(np.maximum, _of(np.maximum, moved, rows, 0), cols, 1),
        vertices,
        _of(np.minimum, _of(np.minimum, np.where(changed, new, np.inf), rows, 0), cols, 1),
        _of(np.maximum, _of(np.maximum, np.where(changed, new, -np.inf), rows, 0), cols, 1),
    )


def widened(
    words: np.ndarray,
    truth: np.ndarray,
    vertices: np.ndarray,
    square: np.ndarray,
    level: int,
    scale: Scale,
    most_m: float,
) -> np.ndarray:
    """First words of the nodes' records, widened so that they bound the errors after edits. Other nodes keep theirs.

    A word has the largest error in the low half, and the root mean square in the high half. `truth` and `vertices` are
    as in `Moves`. `square` says which nodes lie wholly on the map. No error is above `most_m`.
    """
    most, rms = errors_m(words, scale)
    truth, vertices = (np.asarray(m, np.float64) * ROUNDED for m in (truth, vertices))
    more = truth + vertices
    wide = np.minimum(most + more, np.maximum(most, most_m))
    mean = np.sqrt((rms + 2.5 * more) ** 2 + 2.0 ** (1 - level) * most * truth)
    found = pack_pair((wide, np.where(square, np.minimum(mean, wide), wide)), scale.span_m)
    return np.where(more > 0, found, words)


def errors_m(words: np.ndarray, scale: Scale) -> tuple[np.ndarray, np.ndarray]:
    """The two errors of a word, in metres: the largest and the root mean square."""
    most, rms = unpack_pair(words).astype(np.float64) * scale.span_m * ERROR_UNIT
    return most, rms


# --- Along one axis ---------------------------------------------------------------------------------------------------


def _inside(node: int, first: int, level: int, last: int) -> slice:
    """The posts of a closed node that are in the edit, counted from the edit's first post."""
    low = node << level
    return slice(max(low - first, 0), max(min(low + (1 << level), last) + 1 - first, 0))


def _of(function: np.ufunc, values: np.ndarray, parts: list[slice], axis: int) -> np.ndarray:
    """Reduce each part along an axis."""
    whole = (slice(None),) * axis
    return np.stack([function.reduce(values[(*whole, part)], axis=axis) for part in parts], axis)


def _lines(moved: np.ndarray, span: Span, first: int, level: int, last: int, axis: int) -> np.ndarray:
    """The moves along the edges of nodes, lines of posts across an axis; 0 on edges outside the edit."""
    at = np.minimum(np.arange(span[0], span[1] + 1) << level, last) - first
    is_inside = (at >= 0) & (at < moved.shape[axis])
    return np.take(moved, at, axis, mode="clip") * np.expand_dims(is_inside, 1 - axis)
