"""Right triangles by nested errors, written from the papers, in numpy.

Duchaineau and others 1997, "ROAMing terrain: real-time optimally adapting meshes", Visualization: the thickness of a
triangle's wedge is that of its halves and the distance of their vertex to its edge, so it bounds the error of all posts
inside. Lindstrom and Pascucci 2002, "Terrain simplification simplified", IEEE TVCG 8 (3): spheres around the vertices
are nested, so that no vertex is seen from nearer than the one it depends on. There are no queues: each frame is chosen
anew, which gives the mesh that the queues end with.
"""

import numpy as np
from entries.bisection import all_places, distances_to_edges, to_parents, triangles_of


def meshes(heights, spacing_m, cameras, size, tolerance_px):
    """Yield vertices and triangles for each camera."""
    places, own_m = all_places(heights, spacing_m), distances_to_edges(heights)
    thick_m, radius_m = own_m.copy(), np.zeros(heights.shape)

    def nest(parents, children):
        thick_m[parents] = np.maximum(thick_m[parents], own_m[parents] + thick_m[children])
        distance_m = np.linalg.norm(places[parents] - places[children], axis=2)
        radius_m[parents] = np.maximum(radius_m[parents], distance_m + radius_m[children])

    to_parents(len(heights) - 1, nest)
    radius_m += max(spacing_m)  # a triangle reaches a post beyond its finest vertices
    for camera in cameras:
        tan_y = np.tan(np.radians(camera["fov_deg"]) / 2)
        most_px = size[1] / 2 / tan_y * (1 + tan_y**2 * (1 + (size[0] / size[1]) ** 2))  # in the picture's corner
        nearest_m = np.linalg.norm(places - camera["eye"], axis=2) - radius_m
        yield triangles_of((nearest_m <= 0) | (thick_m * most_px > tolerance_px * nearest_m), places)
