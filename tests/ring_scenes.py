"""Captured meshes of method sat, and measurements on them: coverage, edges, the surface's error in pixels."""

from dataclasses import dataclass

import numpy as np
from maps import Scene

from terrain_gl.camera import screen_shift_px
from terrain_gl.gpu import layout, shaders
from terrain_gl.heightmap import bilinear
from terrain_gl.mesh import MeshDraws

PLACES = 5  # along a cell's side
UNIT = 64  # vertices stand on 64ths of a post


def clipmap_of(ctx, heightmap, size=(160, 90)):
    """A scene that draws with method sat."""
    return Scene.of(ctx, heightmap, size)


def change_shaders(monkeypatch, old, new):
    """Shaders that are compiled from now on have another text in one place."""
    body = shaders._body
    monkeypatch.setattr(shaders, "_body", lambda path, of: body(path, of).replace(old, new))


VERTEX = np.dtype([("post", "2f4"), ("height_m", "f4")])
_draws = MeshDraws("CAPTURE", varyings=("v_vertex",))  # one program per scene
_pictures = MeshDraws("PICTURE", varyings=("v_post", "v_of_patch"))


def triangles_of(selection):
    """Triangles as drawn, (n, 3) records `VERTEX`; those of no area are left out."""
    vertices = np.frombuffer(_draws.of(selection.surface).capture(selection, VERTEX.itemsize), VERTEX).reshape(-1, 3)
    return vertices[doubled_areas(in_units(vertices["post"])) != 0]


def doubled_areas(corners):
    """Of triangles with integer corners (n, 3, 2): positive if counter-clockwise seen from above (rows run south)."""
    (ax, ay), (bx, by), (cx, cy) = np.moveaxis(corners, 0, -1)
    return (by - ay) * (cx - ax) - (bx - ax) * (cy - ay)


def in_units(posts):
    """Corners as integers: 64ths of a post."""
    units = np.rint(UNIT * posts.astype("f8")).astype("i8")
    assert (units == UNIT * posts.astype("f8")).all()
    return units


def check_covered_once(drawn, heightmap):
    """Triangles of one orientation cover the map once, every inner edge has two of them, lone edges lie on the rim."""
    corners, last = in_units(drawn["post"]), UNIT * np.array([heightmap.cols - 1, heightmap.rows - 1])
    assert corners.min() >= 0 and (corners <= last).all()
    areas = doubled_areas(corners)
    assert (areas > 0).all()
    assert areas.sum() == 2 * last.prod()
    name = corners[..., 1] << 20 | corners[..., 0]
    ends = np.concatenate([np.stack([name[:, i], name[:, (i + 1) % 3]], 1) for i in range(3)])
    assert len(np.unique(ends, axis=0)) == len(ends), "two triangles on one side of an edge"
    whole, count = np.unique(np.sort(ends, 1), axis=0, return_counts=True)
    assert count.max() <= 2
    lone = np.stack([whole[count == 1] & 0xFFFFF, whole[count == 1] >> 20], -1)
    assert ((lone == 0) | (lone == last)).all(1).any(1).all(), "an open edge inside the map"


def patches_of(scene, selection):
    """Records of the view's patches, decoded: corner, side_log2, step_log2, edges_log2 (n, 4), bound_px."""
    data = selection.buffers.patches.read(selection.patches * layout.PATCH.itemsize)
    return layout.unpack_patches(np.frombuffer(data, layout.PATCH))


CORNER = np.dtype([("post", "2f4"), ("low", "2u2"), ("high", "2u2"), ("step_log2", "f4"), ("shape", "u4")])


def corners_with_patches(scene, selection):
    """Triangles with the patch that each belongs to: (n, 3) records `CORNER`."""
    corners = np.frombuffer(_pictures.of(scene.levels).capture(selection, CORNER.itemsize), CORNER).reshape(-1, 3)
    return corners[doubled_areas(in_units(corners["post"])) != 0]


@dataclass
class Errors:
    """Screen error in pixels over the places that are in the picture."""

    max_px: float
    rms_px: float
    places: int


def surface_errors(scene, selection, camera):
    """Compare the captured triangles with the bilinear truth.

    At 5 × 5 places of every cell, posts among them, and at the middles of triangles and of their sides.

    The root mean square is over the places of cells alone: each is met once.
    """
    drawn = triangles_of(selection)
    posts, heights = drawn["post"].astype("f8"), drawn["height_m"].astype("f8") + scene.terrain.base_m
    extra = np.concatenate([_shares(posts, heights, share) for share in _MIDDLES])
    places = np.concatenate([*_at_places(posts, heights)])
    _, first = np.unique(places[:, :2], axis=0, return_index=True)
    px, seen = _screen_errors(scene, places, camera)
    more, more_seen = _screen_errors(scene, extra, camera)
    own = np.zeros(len(px), bool)
    own[first] = True
    squares = np.square(px[own & seen])
    worst = max(px[seen].max(initial=0.0), more[more_seen].max(initial=0.0))
    return Errors(float(worst), float(np.sqrt(squares.mean())) if len(squares) else 0.0, int((own & seen).sum()))


_MIDDLES = [(1 / 3, 1 / 3, 1 / 3), (0.5, 0.5, 0), (0, 0.5, 0.5), (0.5, 0, 0.5)]


def _shares(posts, heights, share):
    return np.column_stack([np.einsum("nij,i->nj", posts, share), heights @ np.asarray(share)])


def _at_places(posts, heights):
    """Columns, rows and heights (n, 3) of the triangles at multiples of 1/5 post; on common edges more than once."""
    low = np.floor(posts.min(1) * PLACES).astype(int)
    size = np.ceil(posts.max(1) * PLACES).astype(int) - low
    yield np.empty((0, 3))
    for w, h in np.unique(size, axis=0):
        which = np.flatnonzero((size == (w, h)).all(1))
        rows, cols = np.indices((h + 1, w + 1)).reshape(2, -1)
        for part in np.array_split(which, 1 + len(which) * len(rows) // 2_000_000):
            p, z = posts[part], heights[part]
            at = (low[part][:, None] + np.stack([cols, rows], -1)) / PLACES
            a, b, c = (p[:, i, None] for i in range(3))
            area = _cross(b - a, c - a)
            weights = (
                np.stack([_cross(c - b, at - b), _cross(a - c, at - c), _cross(b - a, at - a)], -1) / area[..., None]
            )
            inside = (weights >= 0).all(-1)
            z_at = (weights * z[:, None]).sum(-1)
            yield np.column_stack([at[inside], z_at[inside]])


def _cross(u, v):
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def _screen_errors(scene, places, camera):
    heightmap = scene.heightmap
    col, row, drawn = places.T
    inside = np.minimum(col, heightmap.cols - 1), np.minimum(row, heightmap.rows - 1)  # thirds of a side are rounded
    truth = bilinear(scene.terrain.filled.astype("f8"), *inside)
    east, north = heightmap.spacing_m
    points = np.stack([col * east, (heightmap.rows - 1 - row) * north, truth], -1)
    px, seen = screen_shift_px(camera, scene.size, points, drawn - truth, scene.near_m)
    return px, seen & ~_over_voids(heightmap.heights, col, row)


def _over_voids(heights, col, row):
    """Whether a place lies in a cell with a void corner: the map says nothing of it."""
    if not np.isnan(heights).any():
        return np.zeros(len(col), bool)
    low = np.floor([row, col]).astype(int)
    high = np.minimum(low + 1, np.array(heights.shape)[:, None] - 1)
    corners = [heights[row, col] for row in (low[0], high[0]) for col in (low[1], high[1])]
    return np.isnan(corners).any(0)
