"""The meshes that terrain-gl draws by one of its methods, as its GPU code makes them."""

import numpy as np

from terrain_gl import Camera, Heightmap, Renderer


def drawn(method, heights, spacing_m, cameras, size, **options):
    """Yield vertices, triangles and the milliseconds of the choice for each camera."""
    heightmap = Heightmap(heights, tuple(spacing_m))
    with Renderer(heightmap, tuple(size)) as renderer:
        for camera in cameras:
            camera = Camera(tuple(camera["eye"]), tuple(camera["target"]), camera["fov_deg"])
            options |= {"method": method, "style": "lambert"}
            renderer.choose(camera, **options)  # the first one compiles shaders, and makes tables
            stats = renderer.choose(camera, **options)
            with renderer.session:
                posts, above_m = renderer.inspector.frame.triangles
                heights_m = above_m + float(renderer.terrain.base_m)
            col, row = np.moveaxis(posts.astype(np.float64), -1, 0)
            east, north = col * spacing_m[0], (len(heights) - 1 - row) * spacing_m[1]
            vertices = np.stack([east, north, heights_m], -1).reshape(-1, 3)
            yield vertices, np.arange(len(vertices)).reshape(-1, 3), stats["ms"]["lod"]
