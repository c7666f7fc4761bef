"""The surroundings of the map: which of them a picture may show, and the shader's uniforms (glsl/shade/edge.glsl)."""

from typing import Any

from ..camera import Camera
from ..terrain import Terrain

SURROUNDINGS = ("block", "none")
NONE = 0  # values of EDGE in the shader; with WALLS, the plain is drawn, too
PLAIN = 1
WALLS = 2
OF_KIND = {"OPEN": PLAIN, "SKY": WALLS, "NEAR": NONE, "MIXED": WALLS}  # EDGE in the program of each kind of pixels
BLOCK = 0.025  # how far the block reaches below the lowest post, as a fraction of the map's longer side


def seen_from(camera: Camera, terrain: Terrain) -> int:
    """`WALLS`, or `PLAIN` for an eye above the map: from there no ray meets a wall."""
    x, y = camera.eye[:2]
    east, north = terrain.heightmap.extent_m
    margin_m = 1e-3 * min(terrain.heightmap.spacing_m)
    if camera.is_orthographic:  # its rays start far beside the eye, too
        return WALLS
    return PLAIN if margin_m < x < east - margin_m and margin_m < y < north - margin_m else WALLS


def uniforms(terrain: Terrain, water_m: float | None) -> dict[str, Any]:
    """Height of the surroundings, and whether they are a sea: the user's, else the map's; else the block's foot."""
    heightmap = terrain.heightmap
    base_m = terrain.base_m
    sea_m = water_m if water_m is not None else terrain.sea_m
    plain_m = heightmap.range_m[0] - BLOCK * max(heightmap.extent_m)
    return {"edge_m": (plain_m if sea_m is None else sea_m) - base_m, "edge_is_sea": sea_m is not None}
