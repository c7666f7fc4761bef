"""Draw land with what the lessons have built so far. `python -m course picture` writes this file anew each time.

Run: python my_terrain.py MAP.png PICTURE.png
"""

import ctypes
import sys
import time

import glcontext
import moderngl
import numpy as np
from matplotlib import pyplot as plt

SIZE = 480, 270
EYE, TARGET, FOV_DEG = np.array([9000.0, 3000.0, 4300.0]), np.array([17500.0, 17000.0, -1400.0]), 50.0
SUN = np.array([-0.75, -0.15, 0.64])  # towards the sun
SPACING = 240.0, 240.0  # metres between posts to the east and to the north


def read(path):
    """Heights in metres: each eighth post of the map."""
    return np.float64(plt.imread(path)[::8, ::8] * 65535 * 0.06)


def camera():
    """The camera's axes right, up and ahead, and K, its focal length in pixels."""
    ahead = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, ahead), ahead]), SIZE[1] / 2 / np.tan(np.radians(FOV_DEG) / 2)


def in_camera(places):
    """Points (n, 3) of the world in the camera's axes, (3, n)."""
    return camera()[0] @ (places - EYE).T


def places_of(heights, posts):
    """World coordinates (n, 3) of posts (n, 2), columns and rows."""
    x, y = posts.T
    return np.stack([x * SPACING[0], (len(heights) - 1 - y) * SPACING[1], heights[y, x]], -1)


def mesh(heights):
    """Posts (n, 2) and triangles (m, 3): all posts of the map."""
    return grid(0, 0, heights.shape[1] - 1, heights.shape[0] - 1, 1)


def grid(x, y, wide, high, step):
    """A grid of cells, two triangles each."""
    row, col = np.mgrid[y : y + high + 1 : step, x : x + wide + 1 : step]
    at = np.arange(row.size).reshape(row.shape)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:]))
    return np.stack([col.ravel(), row.ravel()], 1), np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])


def together(parts):
    """One mesh from many meshes; equal posts become one post."""
    offsets = np.cumsum([0] + [len(posts) for posts, _ in parts[:-1]])
    triangles = np.concatenate([triangles + k for (_, triangles), k in zip(parts, offsets)])
    posts, which = np.unique(np.concatenate([posts for posts, _ in parts]), axis=0, return_inverse=True)
    return posts, which.reshape(-1)[triangles]


def paint(heights, posts):
    """Colours (n, 3): meadow, rock and snow."""
    h = (heights[posts[:, 1], posts[:, 0]] - heights.min()) / np.ptp(heights)
    low, middle, high = np.array([[0.20, 0.30, 0.12], [0.36, 0.33, 0.30], [0.90, 0.92, 0.95]])
    t, s = np.clip(h[:, None] / 0.45, 0, 1), np.clip((h[:, None] - 0.45) / 0.25, 0, 1)
    return (low + (middle - low) * t) * (1 - s) + high * s


def light(heights, posts):
    """Light (n,) on posts: the same everywhere, until lesson 1 computes it."""
    return np.full(len(posts), 0.8)


def project(places):
    """Clip coordinates (n, 4)."""
    _, focal = camera()
    x, y, z = in_camera(places)
    return np.stack([x * focal / SIZE[0] * 2, y * focal / SIZE[1] * 2, z - 200.0, z], -1)


VERTEX = """
#version 330
in vec4 in_place; in vec3 in_colour; out vec3 v_colour;
void main() { gl_Position = in_place; v_colour = in_colour; }
"""
FRAGMENT = """
#version 330
in vec3 v_colour; out vec4 out_colour;
void main() { out_colour = vec4(v_colour, 1.0); }
"""


def context(version=330):
    """OpenGL without a window; `extra` finds functions that moderngl lacks."""
    linux = sys.platform.startswith("linux")
    backend = glcontext.get_backend_by_name("egl") if linux else glcontext.default_backend()
    libraries = {"libgl": "libGL.so.1", "libegl": "libEGL.so.1"} if linux else {}
    loader = backend(mode="standalone", glversion=version, **libraries)
    ctx = moderngl.create_context(version, standalone=True, context=loader)
    ctx.extra = loader
    return ctx


def rasterise(size, places, values, triangles, sky):
    """Draw triangles with values (n, 3) at their corners; returns (rows, cols, 3)."""
    ctx = context()
    ctx.enable(moderngl.DEPTH_TEST)
    target = ctx.framebuffer([ctx.texture(size, 4, dtype="f4")], ctx.depth_renderbuffer(size))
    target.use()
    target.clear(*sky)
    data = np.concatenate([places, values], 1)[triangles.ravel()].astype("f4")
    program = ctx.program(VERTEX, FRAGMENT)
    ctx.vertex_array(program, ctx.buffer(data.tobytes()), "in_place", "in_colour").render()
    found = np.frombuffer(target.read(components=3, dtype="f4"), "f4").reshape(size[1], size[0], 3)[::-1].copy()
    ctx.release()
    return found


SKY = 0.62, 0.72, 0.84


def draw(heights, posts, triangles, colours):
    """The picture, (rows, cols, 3) from 0 to 1."""
    return rasterise(SIZE, project(places_of(heights, posts)), colours, triangles, SKY)


def errors_px(heights, posts, triangles):
    """The error of the drawn land at each post, (rows, cols), in pixels; 0 at the rim and outside of the picture."""
    (rows, cols), (x, y) = heights.shape, posts.T
    flat = np.stack([(2 * x + 1) / cols - 1, 1 - (2 * y + 1) / rows, 0 * x, 0 * x + 1], -1)  # from above
    drawn = rasterise((cols, rows), flat, heights[y, x][:, None] * np.ones(3), triangles, (0, 0, 0))[..., 0]
    row, col = np.indices(heights.shape).reshape(2, -1)
    p, (axes, focal) = in_camera(places_of(heights, np.stack([col, row], 1))), camera()
    seen = (p[2] > 300) & (np.abs(p[:2]) * focal / p[2] < np.array(SIZE)[:, None] / 2).all(0)
    seen &= (row > 0) & (row < rows - 1) & (col > 0) & (col < cols - 1)  # rasterisers may leave out the rim
    off, found = np.abs(drawn - heights).ravel()[seen], np.zeros(heights.size)
    a, b, z = p[:, seen]
    found[seen] = focal * off / z * np.hypot(axes[0, 2] - a / z * axes[2, 2], axes[1, 2] - b / z * axes[2, 2])
    return found.reshape(rows, cols)


def error_px(heights, posts, triangles):
    """The largest error of the drawn land, in pixels, over the inner posts that are in the picture."""
    return float(errors_px(heights, posts, triangles).max())


def beside(*pictures):
    """Pictures side by side, with a white line between them."""
    line = np.ones((len(pictures[0]), 4, 3))
    return np.concatenate([part for each in pictures for part in (line, each)][1:], 1)
