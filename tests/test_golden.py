"""Pictures of the bundled maps, against those in tests/golden/.

Only Mesa's software renderer is compared, because its bytes are the same everywhere. `pytest --regenerate` writes the
pictures again.
"""

import json
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import pytest
from maps import island

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import difference, read_image, write_png
from terrain_gl.renderer import Renderer
from terrain_gl.shade.picture import STYLES

GOLDEN = Path(__file__).parent / "golden"
SIZE = (160, 90)
OUTLIERS = 0.001  # share of pixels that may differ by more than 1/255: another LLVM rounds differently
MAPS = json.loads(files("terrain_gl.heightmaps").joinpath("maps.json").read_text())
PICTURES = [("alpine-30m", style) for style in STYLES] + [("canyon-15m", "shaded"), ("canyon-15m", "lod")]
PICTURES[STYLES.index("lod")] = pytest.param("alpine-30m", "lod", marks=pytest.mark.line)


@pytest.fixture(scope="module")
def renderers(session_context):
    """Return a function from a map's name to its renderer, made once."""
    made = {}

    def renderer(name):
        if name not in made:
            entry = MAPS[name]
            with as_file(files("terrain_gl.heightmaps").joinpath(entry["file"])) as path:
                heightmap = Heightmap.open(path, entry["spacing_m"], entry["z_scale"], entry["z_offset_m"])
            heightmap.look = entry["look"]
            made[name] = Renderer(heightmap, SIZE, ctx=session_context)
        return made[name]

    with session_context:
        yield renderer
        for each in made.values():
            each.release()


@pytest.mark.parametrize("name, style", PICTURES)
def test_golden(ctx, renderers, regenerate, tmp_path, name, style):
    if "llvmpipe" not in ctx.info["GL_RENDERER"]:
        pytest.skip(f"golden pictures are llvmpipe's, this is {ctx.info['GL_RENDERER']}")
    view, path = MAPS[name]["view"], GOLDEN / f"{name}_{style}.png"
    camera = Camera(view["eye"], view["target"], view["fov"])
    tolerance_px = 1.0 if style == "shaded" else 2.0
    pixels = renderers(name).render(camera, tolerance_px, style=style, sun=view["sun"]).image[..., :3]
    compare(pixels, path, regenerate, tmp_path)


def test_golden_water(ctx, renderers, regenerate, tmp_path):
    """Land that is drowned up to 700 m: the sea around the map and the water over the land are one surface."""
    if "llvmpipe" not in ctx.info["GL_RENDERER"]:
        pytest.skip(f"golden pictures are llvmpipe's, this is {ctx.info['GL_RENDERER']}")
    view = MAPS["alpine-30m"]["view"]
    camera = Camera(view["eye"], view["target"], view["fov"])
    pixels = renderers("alpine-30m").render(camera, water_m=700.0, sun=view["sun"]).image[..., :3]
    compare(pixels, GOLDEN / "alpine-30m_water.png", regenerate, tmp_path)


def test_golden_lake(ctx, session_context, regenerate, tmp_path):
    """An island in the sea of its map, with a lake: all water is one surface, at two heights."""
    if "llvmpipe" not in ctx.info["GL_RENDERER"]:
        pytest.skip(f"golden pictures are llvmpipe's, this is {ctx.info['GL_RENDERER']}")
    with session_context, Renderer(Heightmap(island(), 30.0), SIZE, ctx=session_context) as renderer:
        pixels = renderer.render(Camera((2500, -900, 1100), (3000, 2800, 150), 50), sun=(200.0, 30.0)).image[..., :3]
    compare(pixels, GOLDEN / "island_lake.png", regenerate, tmp_path)


def compare(pixels, path, regenerate, tmp_path):
    """Compare a picture with a golden one, or write it."""
    if regenerate:
        write_png(path, pixels)
        return
    golden = read_image(path)
    assert golden.shape == pixels.shape
    differs = np.abs(pixels.astype(int) - golden).max(-1) > 1
    if differs.mean() > OUTLIERS:
        write_png(tmp_path / "drawn.png", pixels)
        write_png(tmp_path / "difference.png", difference(pixels, golden))
        pytest.fail(f"{differs.mean():.2%} of the pixels differ from {path.name}; see {tmp_path}/difference.png")


ROOTS = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Values { float values[]; };
void main() {
    float x = values[gl_GlobalInvocationID.x];
    values[2 * gl_NumWorkGroups.x * 64 + gl_GlobalInvocationID.x] = 1.0 / x;
    values[gl_NumWorkGroups.x * 64 + gl_GlobalInvocationID.x] = inversesqrt(x);
}
"""


def test_no_estimates(ctx):
    """Reciprocals and roots are those of IEEE division and roots: instructions that estimate differ by processor."""
    if "llvmpipe" not in ctx.info["GL_RENDERER"]:
        pytest.skip("the bytes of golden pictures are llvmpipe's")
    x = np.exp2(np.random.default_rng(3).uniform(-60, 60, 4096)).astype("f4")
    program = ctx.compute_shader(ROOTS)
    buffer = ctx.buffer(np.concatenate([x, x, x]))
    buffer.bind_to_storage_buffer(0)
    program.run(64)
    _, root, reciprocal = np.frombuffer(buffer.read(), "f4").reshape(3, -1)
    buffer.release()
    program.release()
    np.testing.assert_array_equal(reciprocal, np.float32(1) / x)
    np.testing.assert_array_equal(root, np.float32(1) / np.sqrt(x))
