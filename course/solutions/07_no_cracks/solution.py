"""Lesson 7: find the cracks of a mesh, and close them.

vertices (n, 3) metres x, y, z; triangles (m, 3) numbers of vertices, all turned the same way seen from above.
"""

import numpy as np


def open_edges(triangles):
    """7.1 Edges that belong to only one triangle.

    returns   (k, 2) numbers of vertices, the smaller one first in each row; rows sorted
    """
    # solution
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    unique, uses = np.unique(edges, axis=0, return_counts=True)
    return unique[uses == 1]
    # end


def weld(vertices, triangles, tolerance_m):
    """7.2 Weld vertices within tolerance_m of each other: triangles then use the vertex with the lowest number.

    Vertices that belong together are much closer than tolerance_m; others are much farther apart.

    returns   (m, 3) triangles
    """
    # solution
    order = np.argsort(vertices[:, 0], kind="stable")
    first = np.arange(len(vertices))
    for k, i in enumerate(order):
        for j in order[k + 1 :]:
            if vertices[j, 0] - vertices[i, 0] > tolerance_m:
                break
            if np.linalg.norm(vertices[i] - vertices[j]) <= tolerance_m:
                low, high = sorted((first[i], first[j]))
                first[first == high] = low
    return first[triangles]
    # end


def on_edge(vertices, a, b):
    """7.3 Vertices that lie inside the edge from a to b seen from above, in order from a to b.

    Only x and y count: a vertex above or below the edge is the worst crack. a and b do not lie inside.

    a, b      numbers of vertices
    returns   (k,) numbers of vertices
    """
    # solution
    p, q = vertices[a, :2], vertices[b, :2]
    along, to = q - p, vertices[:, :2] - p
    share = to @ along / (along @ along)
    away = np.abs(to[:, 0] * along[1] - to[:, 1] * along[0]) / np.linalg.norm(along)
    found = np.flatnonzero((away < 1e-9 * np.linalg.norm(along)) & (share > 1e-9) & (share < 1 - 1e-9))
    return found[np.argsort(share[found])]
    # end


def repair(vertices, triangles):
    """7.4 Cut triangles at the vertices that lie on their edges, until no vertex lies inside an edge.

    No vertex is moved or added. The triangles cover the same area as before, once, and keep their orientation.

    returns   (m, 3) triangles
    """
    # solution
    found, todo = [], [tuple(int(i) for i in t) for t in triangles]
    while todo:
        a, b, c = todo.pop()
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
            inside = on_edge(vertices, p, q)
            if len(inside):
                m = int(inside[0])
                todo += [(p, m, r), (m, q, r)]
                break
        else:
            found.append((a, b, c))
    return np.array(found)
    # end
