"""The style "cracks", which draws patches that do not agree on edges: its counts, its pictures, and no certificate."""

import numpy as np
import pytest
from test_mesh import lone_edges

from terrain_gl.camera import Camera
from terrain_gl.gpu import layout
from terrain_gl.heightmap import Heightmap
from terrain_gl.lod.cracks import count_cracks, count_triangles
from terrain_gl.renderer import Renderer

TOLERANCE_PX = 4.0


def patches(*given):
    """Patches: corner, log2 of side, log2 of step, log2 of the segments of each edge."""
    corner, side, step, edges = (np.array(each) for each in zip(*given, strict=True))
    return layout.Patches(corner, side, step, edges, np.zeros(len(given)))


def test_a_crack_is_counted_once_on_its_coarser_side_and_never_at_a_rim():
    coarse = ((0, 0), 3, 2, (1, 1, 2, 1))  # 2 × 2 quads; its east edge has 4 segments, those of the next
    fine = ((8, 0), 3, 1, (2, 2, 2, 2))
    beyond = ((16, 0), 3, 2, (3, 3, 3, 3))  # no part of its edges is inside the map
    assert count_cracks(patches(coarse, fine, beyond), (16, 16)) == 1
    assert count_cracks(patches(coarse), (8, 16)) == 0
    assert count_triangles(patches(coarse, fine, beyond), (16, 16)) == 8 + 32
    assert count_triangles(patches(fine), (11, 16)) == 2 * 2 * 4  # a half of its second column of quads is on the map


CAMERA = Camera((1000.0, -100.0, 150.0), (1000.0, 800.0, 0.0), 50.0)


@pytest.fixture(scope="module")
def renderer(session_context):
    """A map that is flat in the west and rough in the east: its patches have many sizes."""
    noise = np.random.default_rng(1).normal(size=(161, 201))
    heightmap = Heightmap((12 * noise * np.linspace(0, 1, 201) ** 4).astype("f4"), 10.0)
    with session_context, Renderer(heightmap, (240, 150), ctx=session_context) as renderer:
        yield renderer


def is_red(image):
    return (image[..., 0] == 255) & (image[..., 1] == 0) & (image[..., 2] == 0)


def inner_edges(triangles, last):
    """Edges with one triangle alone that are not on the map's rim."""
    lone = lone_edges(triangles)
    return lone[~((lone == 0) | (lone == last)).all(1).any(1)]


def test_cracks_are_seen_counted_and_not_certified(ctx, renderer):
    heightmap = renderer.heightmap
    last = np.array([heightmap.cols - 1, heightmap.rows - 1])
    options = {"cull": False}
    cracked = renderer.render(CAMERA, TOLERANCE_PX, style="cracks", **options)
    triangles = renderer.inspector.triangles()
    assert cracked.stats["certified_max_error_px"] is None and cracked.stats["requested_max_error_px"] == TOLERANCE_PX
    assert cracked.stats["triangles"] == len(triangles)
    assert 0 < cracked.stats["cracks"] <= len(inner_edges(triangles, last))
    assert 0 < is_red(cracked.image).mean() < 0.1
    whole = renderer.render(CAMERA, TOLERANCE_PX, style="segments", **options)
    assert whole.stats["certified_max_error_px"] <= TOLERANCE_PX and "cracks" not in whole.stats
    assert len(inner_edges(renderer.inspector.triangles(), last)) == 0


def test_a_mesh_of_every_post_has_no_cracks(ctx, renderer):
    frame = renderer.render(CAMERA, style="cracks", method="full")
    assert frame.stats["cracks"] == 0 and not is_red(frame.image).any()


def test_a_method_without_patches_keeps_its_mesh_and_claims_nothing(ctx, renderer):
    frame = renderer.render(CAMERA, triangles=2000, style="cracks", method="clipmap")
    assert "cracks" not in frame.stats and frame.stats["certified_max_error_px"] is None


def test_a_click_explains_a_patch_with_cracks(ctx, renderer):
    east, north = (0.5 * side for side in renderer.heightmap.extent_m)
    found = []
    for style in ("segments", "cracks"):
        renderer.draw(CAMERA, 2.0, style=style)
        found.append(renderer.inspector.explain(east, north))
    assert found[0] is not None and found[0] == found[1]
