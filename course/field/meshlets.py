"""Meshlets: how often a vertex is computed.

Run: python -m course.field.meshlets
"""

import numpy as np

from course.field import own
from course.land import land

six = own(6)
VERTICES, TRIANGLES = 64, 126  # of a meshlet, as hardware likes them


def computed(triangles):
    """Vertices of all meshlets: triangles in their order, a new meshlet where one is full."""
    total, inside, count = 0, set(), 0
    for triangle in triangles.tolist():
        if count == TRIANGLES or len(inside | set(triangle)) > VERTICES:
            total, inside, count = total + len(inside), set(), 0
        inside |= set(triangle)
        count += 1
    return total + len(inside)


def main():
    """Compare orders of the triangles of one mesh."""
    heights = land(np.random.default_rng(1), 129, 129)
    corners = six.rtin_mesh(six.rtin_errors(heights), 3.0)
    posts, number = np.unique(np.reshape(corners, (-1, 2)), axis=0, return_inverse=True)
    triangles = number.reshape(-1, 3)
    middles = posts[triangles].mean(1)
    orders = {
        "of the tree": np.arange(len(triangles)),
        "of rows": np.lexsort((middles[:, 0], middles[:, 1])),
        "by chance": np.random.default_rng(2).permutation(len(triangles)),
    }
    print(f"{len(triangles)} triangles, {len(posts)} vertices")
    for name, order in orders.items():
        print(f"order {name}: {computed(triangles[order]) / len(posts):.2f} times each vertex")


if __name__ == "__main__":
    main()
