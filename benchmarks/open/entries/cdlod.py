"""Continuous distance-dependent level of detail, written from the paper, in numpy.

Strugar 2009, "Continuous distance-dependent level of detail for rendering heightmaps", Journal of Graphics, GPU, and
Game Tools 14 (4). A node of level l is a grid of `GRID` cells a side, 2^l posts each. Level l is used within a range of
the eye, which doubles with each level. In the last part of it, vertices move to the places of the next level, so that
levels meet without cracks. The method knows distances and no errors. The paper leaves the first range to the user:
here, a cell at its end is `CELL_PX` times the tolerance wide on the screen.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

GRID = 16
CELL_PX = 4.0
MORPH = 0.7  # the part of a range after which vertices move


def meshes(heights, spacing_m, cameras, size, tolerance_px):
    """Yield vertices and triangles for each camera."""
    steps_m = np.array(spacing_m)
    boxes = _boxes(heights)
    tallest_m = [float((high - low).max()) / 2**level for level, (low, high) in enumerate(boxes)]
    least_m = (np.linalg.norm(GRID * steps_m) + max(tallest_m)) / (2 * MORPH - 1)  # so that only equal levels meet
    for camera in cameras:
        focal_px = size[1] / 2 / np.tan(np.radians(camera["fov_deg"]) / 2)
        first_m = max(focal_px * steps_m.max() / (CELL_PX * tolerance_px), least_m)
        ranges_m = first_m * 2.0 ** np.arange(len(boxes))
        ranges_m[-1] = np.inf
        view = _View(heights, steps_m, boxes, np.array(camera["eye"]), ranges_m)
        yield view.mesh(view.parts(len(boxes) - 1, 0, 0))


def _boxes(heights):
    """Least and largest heights of the nodes of each level, the finest first: arrays (2, rows, cols)."""
    nodes = sliding_window_view(heights, (GRID + 1, GRID + 1))[::GRID, ::GRID]
    levels = [np.stack([nodes.min((2, 3)), nodes.max((2, 3))])]
    while len(levels[-1][0]) > 1:
        low, high = ([each[i::2, j::2] for i in (0, 1) for j in (0, 1)] for each in levels[-1])
        levels.append(np.stack([np.minimum.reduce(low), np.maximum.reduce(high)]))
    return levels


class _View:
    """What is chosen for one eye."""

    def __init__(self, heights, steps_m, boxes, eye, ranges_m):
        self.heights, self.steps_m, self.boxes, self.eye, self.ranges_m = heights, steps_m, boxes, eye, ranges_m

    def parts(self, level, row, col):
        """Grids (level, first row, first column, cells a side) of a node; None if it is out of its level's range."""
        side = GRID << level
        low_m, high_m = self.boxes[level][:, row, col]
        corners = self._places(np.array([[row + 1, col], [row, col + 1]]) * side, np.array([low_m, high_m]))
        distance_m = np.linalg.norm(np.clip(self.eye, *corners) - self.eye)
        if distance_m > self.ranges_m[level]:
            return None
        if level == 0 or distance_m > self.ranges_m[level - 1]:
            return [(level, row * side, col * side, GRID)]
        found = []
        for child in ((2 * row + i, 2 * col + j) for i in (0, 1) for j in (0, 1)):
            below = self.parts(level - 1, *child)
            found += [(level, *(side // 2 * np.array(child)), GRID // 2)] if below is None else below
        return found

    def mesh(self, parts):
        """Vertices and triangles of the grids."""
        vertices, triangles, count = [], [], 0
        for level, row, col, cells in parts:
            at = np.indices((cells + 1, cells + 1)).reshape(2, -1).T
            posts = (np.array([row, col]) + (at << level)).astype(np.float64)
            distance_m = np.linalg.norm(self._places(posts, self._heights_at(posts)) - self.eye, axis=1)
            share = self.moved_share(distance_m, level)
            moved = posts - (at % 2 << level) * share[:, None]
            vertices.append(self._places(moved, self._heights_at(moved)))
            number = count + np.arange(len(at)).reshape(cells + 1, -1)
            nw, ne, sw, se = (number[i : cells + i, j : cells + j].reshape(-1) for i in (0, 1) for j in (0, 1))
            triangles += [np.stack([nw, sw, ne], -1), np.stack([ne, sw, se], -1)]
            count += len(at)
        return np.concatenate(vertices), np.concatenate(triangles)

    def moved_share(self, distance_m, level):
        """How far vertices have moved to the places of the next level."""
        return np.clip((distance_m / self.ranges_m[level] - MORPH) / (1 - MORPH), 0, 1)

    def _places(self, posts, heights_m):
        east, north = posts[:, 1] * self.steps_m[0], (len(self.heights) - 1 - posts[:, 0]) * self.steps_m[1]
        return np.stack([east, north, heights_m], -1)

    def _heights_at(self, posts):
        """Bilinear heights, as the sampler of a texture gives them."""
        row, col = np.minimum(posts.astype(int), np.array(self.heights.shape) - 2).T
        v, u = posts.T - [row, col]
        upper = self.heights[row, col] * (1 - u) + self.heights[row, col + 1] * u
        lower = self.heights[row + 1, col] * (1 - u) + self.heights[row + 1, col + 1] * u
        return upper * (1 - v) + lower * v
