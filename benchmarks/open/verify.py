"""The verifier: how far the triangles of a dump are from its map, in pixels, and how much they jump.

It needs numpy alone. `check.py` and `seams.py` of terrain_gl/verify, which need numpy alone, too, are loaded by their
path. They find the exact largest error over the surface: docs/meshes.md.

Run: python benchmarks/open/verify.py DIR ...    prints the figures of each frame of all dumps in the folders
"""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np

NEAR_M = 1e-3


def _loaded(name):
    """A module of terrain_gl/verify, without the package."""
    path = Path(__file__).parents[2] / "terrain_gl" / "verify" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"open_{name}", path)
    sys.modules[spec.name] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


check_mesh, find_seams = _loaded("check").check_mesh, _loaded("seams").find_seams


class View:
    """A pinhole camera: z is up in the world, `fov_deg` is from the picture's bottom to its top."""

    def __init__(self, camera, size):
        self.eye = np.array(camera["eye"], np.float64)
        forward = np.array(camera["target"], np.float64) - self.eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        self.axes = np.stack([right, np.cross(right, forward), forward])
        self.focal_px = size[1] / 2 / np.tan(np.radians(camera["fov_deg"]) / 2)
        self.half_px = np.array(size) / 2

    def project(self, points):
        """Pixels from the middle of the picture (n, 2), and depths; the depth of a point at or behind the eye is 0."""
        at = (points - self.eye) @ self.axes.T
        depth = np.where(at[:, 2] < NEAR_M, 0.0, at[:, 2])
        return self.focal_px * at[:, :2] / np.where(depth > 0, depth, 1.0)[:, None], depth

    def sees(self, points):
        """Whether points are in the picture."""
        px, depth = self.project(points)
        return (depth > 0) & (np.abs(px) <= self.half_px).all(1)

    def shift_px(self, points, heights_m):
        """How far points of the picture move on it when they get other heights; 0 for others."""
        px, depth = self.project(points)
        moved_px, moved_depth = self.project(np.column_stack([points[:, :2], heights_m]))
        shift = np.where(moved_depth > 0, np.linalg.norm(moved_px - px, axis=1), np.inf)
        return np.where((depth > 0) & (np.abs(px) <= self.half_px).all(1), shift, 0.0)

    def may_see(self, corners):
        """Whether triangles (m, 3, 3) are not wholly outside one of the picture's sides."""
        x, y, z = np.moveaxis((corners - self.eye) @ self.axes.T, -1, 0)
        tan_x, tan_y = self.half_px / self.focal_px
        sides = (z, tan_x * z - x, tan_x * z + x, tan_y * z - y, tan_y * z + y)
        return np.logical_and.reduce([(side > 0).any(1) for side in sides])


def verified_frame(heights, spacing_m, view, vertices, triangles):
    """The figures of a frame, and the drawn heights of all posts; NaN where nothing is drawn."""
    rows, cols = heights.shape
    east, north = spacing_m
    drawn_m = np.full(heights.shape, np.nan)

    def shift_px(col, row, truth_m, top_m):
        is_post = (col == np.floor(col)) & (row == np.floor(row))
        drawn_m[row[is_post].astype(int), col[is_post].astype(int)] = top_m[is_post]
        return view.shift_px(np.stack([col * east, (rows - 1 - row) * north, truth_m], -1), top_m)

    vertices, number = np.unique(vertices, axis=0, return_inverse=True)
    faces = number.reshape(-1)[triangles]
    posts = np.stack([vertices[:, 0] / east, rows - 1 - vertices[:, 1] / north], -1)
    found = check_mesh(heights, posts, vertices[:, 2], faces, shift_px)
    seen = view.sees(_places(heights, spacing_m)).reshape(heights.shape)
    errors_px = found.of_posts[seen & ~np.isnan(found.of_posts)]
    return {
        "triangles": int(view.may_see(vertices[faces]).sum()),
        "max_px": found.surface,
        "max_posts_px": found.posts,
        "mean_px": float(errors_px.mean()) if len(errors_px) else 0.0,
        "uncovered_posts": int((seen & np.isnan(found.of_posts)).sum()),
        "largest_crack_m": find_seams(posts, vertices[:, 2], faces, heights.shape).largest_crack_m,
    }, drawn_m


def _places(heights, spacing_m):
    """(n, 3) places of all posts."""
    row, col = np.indices(heights.shape).reshape(2, -1)
    return np.stack([col * spacing_m[0], (heights.shape[0] - 1 - row) * spacing_m[1], heights.reshape(-1)], -1)


def read_frame(file):
    """Vertices and triangles of a frame of a dump."""
    with np.load(file) as dump:
        vertices, triangles = dump["vertices"].astype(np.float64), dump["triangles"].astype(np.int64)
    if vertices.shape[1:] != (3,) or triangles.shape[1:] != (3,):
        raise ValueError(f"vertices are {vertices.shape}, triangles {triangles.shape}: expected (n, 3) and (m, 3)")
    if triangles.min(initial=0) < 0 or triangles.max(initial=-1) >= len(vertices):
        raise ValueError("a triangle names a vertex that is missing")
    if not np.isfinite(vertices[triangles]).all():
        raise ValueError("a vertex is not finite")
    return vertices, triangles


def verify(folder):
    """The figures of all frames of a dump: a list of dicts. The first frame has no jump."""
    folder = Path(folder)
    flight = json.loads((folder / "flight.json").read_text())
    heights, frames, before_m = np.load(folder / "map.npy").astype(np.float64), [], None
    for i, camera in enumerate(flight["cameras"]):
        file = folder / f"{i:04}.npz"
        try:
            vertices, triangles = read_frame(file)
        except (OSError, KeyError, ValueError) as error:
            raise SystemExit(f"{file}: {error}") from None
        view = View(camera, flight["size"])
        frame, drawn_m = verified_frame(heights, flight["spacing_m"], view, vertices, triangles)
        if before_m is not None:  # a jump: how far the drawn surface moves on the later picture
            both = ~np.isnan(before_m + drawn_m).reshape(-1)
            places = _places(np.nan_to_num(drawn_m), flight["spacing_m"])[both]
            jumps_px = view.shift_px(places, before_m.reshape(-1)[both])[view.sees(places)]
            mean_px = float(jumps_px.mean()) if len(jumps_px) else 0.0
            frame |= {"max_jump_px": float(jumps_px.max(initial=0.0)), "mean_jump_px": mean_px}
        before_m = drawn_m
        frames.append(frame)
    return frames


if __name__ == "__main__":
    dumps = [found.parent for name in sys.argv[1:] for found in sorted(Path(name).rglob("flight.json"))]
    for dump in dumps:
        for number, figures in enumerate(verify(dump)):
            print(dump, number, json.dumps(figures))
    if not dumps:
        sys.exit("expected folders with a dump, or with many: " + __doc__.splitlines()[-1].strip())
