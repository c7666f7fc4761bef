"""Tiles of quantized-mesh as other tools make them: a row of docs/tiles.md.

    pip install pymartini quantized-mesh-encoder
    python benchmarks/other_tiles.py MAP FOLDER martini|delatin [METRES]
    terrain-gl check FOLDER --map MAP

For each tile of the levels that cover the map, the map is resampled to 257 × 257 posts, bilinearly; then it is meshed
with one tolerance for all levels: METRES, or the value in the documentation of the mesher (pymartini 10, pydelatin 30).
MAP is in degrees.
"""

import json
import sys
from pathlib import Path

import numpy as np

import terrain_gl as tg
from terrain_gl.mesh import vertex_heights
from terrain_gl.terrain.filling import fill_voids

SIDE = 256
DOCUMENTED_M = {"martini": 10.0, "delatin": 30.0}


def mesh(name, heights, tolerance_m):
    """Columns, rows from the south, and faces of a tile."""
    if name == "martini":
        from pymartini import Martini

        flat, faces = Martini(SIDE + 1).create_tile(np.ascontiguousarray(heights, np.float32)).get_mesh(tolerance_m)
        posts, faces = np.asarray(flat, np.int64).reshape(-1, 2), np.asarray(faces, np.uint32).reshape(-1, 3)
    else:
        from pydelatin import Delatin

        tin = Delatin(np.ascontiguousarray(heights, np.float32), max_error=tolerance_m)
        posts, faces = np.asarray(tin.vertices)[:, :2].astype(np.int64), np.asarray(tin.triangles, np.uint32)
        posts[:, 1] = SIDE - posts[:, 1]  # its rows count from the south
    return posts, faces


def main():
    """Write the tiles."""
    from quantized_mesh_encoder import encode

    source, folder, name, *metres = sys.argv[1:]
    tolerance_m = float(metres[0]) if metres else DOCUMENTED_M[name]
    heightmap = tg.Heightmap.open(source)
    filled = fill_voids(heightmap.heights)
    grid = heightmap.place.georeference.grid
    west, north = grid.c + grid.a / 2, grid.f + grid.e / 2  # of the first post
    east, south = west + grid.a * (heightmap.cols - 1), north + grid.e * (heightmap.rows - 1)
    top = int(np.floor(np.log2(180 / max(east - west, north - south))))
    finest = int(np.ceil(np.log2(180 / SIDE / abs(grid.a))))
    for level in range(top, finest + 1):
        width = 180 / 2**level
        for col in range(int((west + 180) / width), int((east + 180) / width) + 1):
            for row in range(int((south + 90) / width), int((north + 90) / width) + 1):
                low = np.array([col * width - 180, row * width - 90])
                shares = np.arange(SIDE + 1) / SIDE * width
                lon, lat = np.meshgrid(low[0] + shares, low[1] + shares[::-1])
                on_map = np.stack([(lon - west) / grid.a, (lat - north) / grid.e], -1)
                heights = vertex_heights(filled, np.clip(on_map, 0, [heightmap.cols - 1, heightmap.rows - 1]))
                posts, faces = mesh(name, heights, tolerance_m)
                at = np.column_stack([lon[0, posts[:, 0]], lat[posts[:, 1], 0], heights[posts[:, 1], posts[:, 0]]])
                path = Path(folder) / str(level) / str(col) / f"{row}.terrain"
                path.parent.mkdir(parents=True, exist_ok=True)
                with open(path, "wb") as file:
                    encode(file, at, faces, bounds=(*low, *(low + width)))
    head = {"format": "quantized-mesh-1.0", "scheme": "tms", "projection": "EPSG:4326", "version": "1.0.0"}
    head |= {"tilejson": "2.1.0", "tiles": ["{z}/{x}/{y}.terrain"], "minzoom": top, "maxzoom": finest}
    (Path(folder) / "layer.json").write_text(json.dumps(head))


if __name__ == "__main__":
    main()
