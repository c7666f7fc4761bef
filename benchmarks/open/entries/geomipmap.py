"""Geometrical mipmapping, written from the paper, in numpy.

de Boer 2000, "Fast terrain rendering using geometrical mipmapping". The map is cut into blocks of `BLOCK` cells a side.
A block of level k draws every 2^k-th post. It takes the coarsest level up to which all levels are within the tolerance:
the largest error at its posts, times the focal length, over the eye's distance to the block. Where a neighbour is
coarser, vertices of the rim move to posts that both have, so there are no cracks. The errors do not know these moves.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

BLOCK = 32


def meshes(heights, spacing_m, cameras, size, tolerance_px):
    """Yield vertices and triangles for each camera."""
    rows, cols = heights.shape
    row, col = np.indices(heights.shape).reshape(2, -1)
    vertices = np.stack([col * spacing_m[0], (rows - 1 - row) * spacing_m[1], heights.reshape(-1)], -1)
    errors_m = np.stack([_errors_m(heights, 1 << level) for level in range(BLOCK.bit_length())])
    low, high = _corners(vertices.reshape(rows, cols, 3))
    for camera in cameras:
        eye = np.array(camera["eye"])
        focal_px = size[1] / 2 / np.tan(np.radians(camera["fov_deg"]) / 2)
        distance_m = np.linalg.norm(np.clip(eye, low, high) - eye, axis=2)
        is_within = errors_m * focal_px <= tolerance_px * distance_m
        levels = np.logical_and.accumulate(is_within).sum(0) - 1
        yield vertices, np.concatenate([_triangles(levels, *block, cols) for block in np.ndindex(levels.shape)])


def _blocks(posts):
    """(blocks down, blocks across, BLOCK + 1, BLOCK + 1) values of posts."""
    return sliding_window_view(posts, (BLOCK + 1, BLOCK + 1))[::BLOCK, ::BLOCK]


def _corners(places):
    """Lowest and highest corners of the boxes around blocks."""
    blocks = np.stack([_blocks(each) for each in np.moveaxis(places, -1, 0)], -1)
    return blocks.min((2, 3)), blocks.max((2, 3))


def _errors_m(heights, step):
    """Largest error at the posts of each block that draws every `step`-th post; diagonals go from sw to ne."""
    (row, col), (v, u) = np.divmod(np.indices(heights.shape), step)
    last = (len(heights) - 1) // step - 1
    u, v = u / step + np.maximum(col - last, 0), v / step + np.maximum(row - last, 0)
    row, col = np.minimum(row, last), np.minimum(col, last)
    drawn = heights[::step, ::step]
    nw, ne, sw, se = (drawn[row + i, col + j] for i in (0, 1) for j in (0, 1))
    upper, lower = nw + u * (ne - nw) + v * (sw - nw), se + (1 - u) * (sw - se) + (1 - v) * (ne - se)
    return _blocks(np.abs(np.where(u + v < 1, upper, lower) - heights)).max((2, 3))


def _triangles(levels, i, j, cols):
    """The triangles of a block, by numbers of posts."""
    at = np.arange(0, BLOCK + 1, 1 << levels[i, j])
    row, col = np.meshgrid(at, at, indexing="ij", copy=True)
    _move_rims(row, col, 1 << np.maximum(np.pad(levels, 1, mode="edge")[i : i + 3, j : j + 3], levels[i, j]))
    number = (row + i * BLOCK) * cols + col + j * BLOCK
    nw, ne, sw, se = (number[a : len(at) - 1 + a, b : len(at) - 1 + b].reshape(-1) for a in (0, 1) for b in (0, 1))
    faces = np.concatenate([np.stack([nw, sw, ne], -1), np.stack([ne, sw, se], -1)])
    return faces[(faces != np.roll(faces, 1, 1)).all(1)]  # moved vertices leave triangles without an area


def _move_rims(row, col, steps):
    """Move vertices of the four rims to posts that the neighbours draw, too. `steps` are those around the block."""
    for line, up, left in ((0, steps[0, 1], steps[1, 0]), (-1, steps[2, 1], steps[1, 2])):
        col[line] -= col[line] % up
        row[:, line] -= row[:, line] % left
