"""error, continued: bounds of nodes whose posts have moved. They hold until the errors are computed anew."""

import numpy as np

from .nodes import nodes_along


def node_moves(moved: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """For each node, the largest move of its posts, and the largest move of posts on its edges (possible vertices).

    Parameters
    ----------
    moved
        (rows, cols) metres by which each post of the map has moved, up or down.
    """
    rows, cols = (nodes_along(n, level) for n in moved.shape)
    truth, vertices = np.zeros((2, len(rows.low), len(cols.low)))
    for i, j in np.ndindex(truth.shape):
        node = np.abs(moved[rows.low[i] : rows.high[i] + 1, cols.low[j] : cols.high[j] + 1])
        edges = node[0].max(), node[-1].max(), node[:, 0].max(), node[:, -1].max()
        truth[i, j] = node.max()
        vertices[i, j] = max(edges)
    return truth, vertices


def widened_errors(
    most: np.ndarray, rms: np.ndarray, truth: np.ndarray, vertices: np.ndarray, level: int
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the largest error and of the root mean square after posts have moved (docs/guarantee.md, section 9).

    Truth moves by at most `truth`, vertices by at most `vertices`.
    With s = truth + vertices:  max' = max + s,  rms'² = (rms + 5/2 s)² + 2^(1−level) max · truth, at most max'².
    """
    s = truth + vertices
    square = (rms + 2.5 * s) ** 2 + 2.0 ** (1 - level) * most * truth
    return most + s, np.minimum(np.sqrt(square), most + s)
