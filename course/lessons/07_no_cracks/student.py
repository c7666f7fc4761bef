"""Lesson 7: find the cracks of a mesh, and close them.

vertices (n, 3) metres x, y, z; triangles (m, 3) numbers of vertices, all turned the same way seen from above.
"""

import numpy as np


def open_edges(triangles):
    """7.1 Edges that belong to only one triangle.

    returns   (k, 2) numbers of vertices, the smaller one first in each row; rows sorted
    """
    raise NotImplementedError("write this")


def weld(vertices, triangles, tolerance_m):
    """7.2 Weld vertices within tolerance_m of each other: triangles then use the vertex with the lowest number.

    Vertices that belong together are much closer than tolerance_m; others are much farther apart.

    returns   (m, 3) triangles
    """
    raise NotImplementedError("write this")


def on_edge(vertices, a, b):
    """7.3 Vertices that lie inside the edge from a to b seen from above, in order from a to b.

    Only x and y count: a vertex above or below the edge is the worst crack. a and b do not lie inside.

    a, b      numbers of vertices
    returns   (k,) numbers of vertices
    """
    raise NotImplementedError("write this")


def repair(vertices, triangles):
    """7.4 Cut triangles at the vertices that lie on their edges, until no vertex lies inside an edge.

    No vertex is moved or added. The triangles cover the same area as before, once, and keep their orientation.

    returns   (m, 3) triangles
    """
    raise NotImplementedError("write this")
