"""A page that shows a mesh in any browser, without a network: one HTML file with everything inside.

The page is `html/land.html`. It draws with three.js. `html/three.min.js` has the parts of three.js that this page and
the page of tiles use; `.ci/three` makes that file.
"""

import base64
import html
import json
import re
from collections.abc import Iterator
from importlib.resources import files

import numpy as np

from .mesh_formats import Mesh, rim_of, shared


def land_page(mesh: Mesh, name: str) -> Iterator[bytes]:
    """A page for browsers: the mesh with its texture, walls along the rim, and everything that draws them."""
    mesh = shared(mesh)
    folder = files(__package__) / "html"
    everything = slice(0, len(mesh.posts))
    world = mesh.world(everything)
    middle = [*(world.min(0) + world.max(0))[:2] / 2, mesh.base_m]  # small numbers, so that float32 is exact enough
    east, north, up = (world - middle).T
    spacing = np.array(mesh.spacing_m)
    size = np.array(mesh.heights.shape[::-1]) * spacing  # of the texture, which reaches half a cell beyond the posts
    corner = -0.5 * spacing - [middle[0], middle[1]] + [0.0, size[1]]  # its north-western corner, in the page's metres
    data = {
        "places": _text(np.stack([east, up, -north], -1), "<f4"),
        "texture_corner": [corner[0], -corner[1]],
        "texture_size": [*size],
        "faces": _text(mesh.faces, "<u4"),
        "rim": _text(rim_of(mesh.faces.astype(np.int64)), "<u4"),
        "texture": base64.b64encode(mesh.texture or b"").decode(),
    }
    bound = f"{len(mesh.faces):,} triangles"
    if mesh.within_m is not None:
        bound += f", nowhere more than {mesh.within_m:.3g} m above or below the map"
    if mesh.error_m is not None:
        bound += (
            f", at most {mesh.error_m[0]:.3g} m above or below the map's posts, {mesh.error_m[1]:.3g} m between them"
        )
    parts = {
        "title": html.escape(name),
        "bound": bound,
        "mesh": json.dumps(data),
        "library": (folder / "three.min.js").read_text("utf-8"),
    }
    page = (folder / "land.html").read_text("utf-8")
    for piece in re.split(f"({'|'.join(f'{{{key}}}' for key in parts)})", page):
        yield parts.get(piece[1:-1], piece).encode("utf-8")


def _text(numbers: np.ndarray, kind: str) -> str:
    """Numbers as text: base64 of little-endian binary."""
    return base64.b64encode(numbers.astype(kind).tobytes()).decode()
