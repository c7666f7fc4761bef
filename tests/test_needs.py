"""What the shaders need of a driver, counted in their text. A limit that is too low is told before the first frame."""

import re
from pathlib import Path

import pytest
from maps import rough

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.camera import Camera
from terrain_gl.error import sizes
from terrain_gl.gpu import gl, layout, needs, selftest, shaders
from terrain_gl.heightmap import Heightmap
from terrain_gl.light.gaussians import LIGHTS
from terrain_gl.light.lighting import tables_of
from terrain_gl.pages.pool import ROW
from terrain_gl.renderer import Renderer
from terrain_gl.store.cache import PAYS_POSTS
from terrain_gl.verify.measure import PLACES, TILE

ROOT = shaders.root()
TEXT = {
    suffix: [shaders.source(path.relative_to(ROOT).as_posix()) for path in sorted(ROOT.rglob(f"*.{suffix}"))]
    for suffix in ("comp", "frag")
}
STAGES = {"compute": "comp", "fragment": "frag"}
DECLARED = {
    "storage_blocks": r"layout\(std430[^;{]*\bbuffer\s+(\w+)",
    "images": r"\buniform\b[^;{]*\b[iu]?image\w+\s+(\w+)",
    "textures": r"\buniform\b[^;{]*\b(?:[iu]?sampler\w+|PER_SAMPLE)\s+(\w+)",
}


def constant(text, expression):
    """The value of a constant expression of a shader."""
    macros = dict(re.findall(r"^\s*#define (\w+) (.+)$", text, re.M)) | dict(
        re.findall(r"\bconst int (\w+) = ([^;]+);", text)
    )
    while re.search(r"[A-Za-z_]", expression):
        expression = re.sub(r"\d+u\b", lambda number: number[0][:-1], expression)
        expression = re.sub(r"[A-Za-z_]\w*", lambda name: f"({macros[name[0]]})", expression)
    return eval(expression.replace("/", "//"), {"__builtins__": {}})


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("what", DECLARED)
def test_the_shaders_use_as_many_as_the_table_says_and_no_more(stage, what):
    most = max(len(set(re.findall(DECLARED[what], text))) for text in TEXT[STAGES[stage]])
    assert most == needs.NEEDS[f"{stage}_{what}"][0]


def test_image_units_and_threads_of_a_group_are_counted_too():
    units = re.findall(r"binding = (\d+)\)[^;{]*\bimage2D\w*", "".join(TEXT["comp"] + TEXT["frag"]))
    units += re.findall(r"binding = (\d+)\)[^;{]*\buimage2D", "".join(TEXT["comp"] + TEXT["frag"]))
    assert max(map(int, units)) + 1 == needs.NEEDS["image_units"][0]
    sides = [(text, re.findall(r"\blocal_size_\w = (\w+)", text)) for text in TEXT["comp"]]
    threads = [[constant(text, side) for side in each] for text, each in sides]
    assert max(each[0] * each[-1] if len(each) > 1 else each[0] for each in threads) == 256
    assert needs.NEEDS["compute_invocations"][0] == 256


def test_shared_memory_blocks_and_textures_fit():
    shared = [
        sum(
            4 * constant(text, size or "1")
            for line in re.findall(r"\bshared \w+ ([^;]+);", text)
            for size in re.findall(r"\w+(?:\[([^]]+)\])?", line)
        )
        for text in TEXT["comp"]
    ]
    assert 0 < max(shared) <= needs.NEEDS["shared_bytes"][0]
    blocks = layout.TERRAIN, layout.VIEW, layout.RINGS, LIGHTS
    assert max(block.itemsize for block in blocks) <= needs.NEEDS["uniform_block_bytes"][0]
    assert needs.NEEDS["texture_size"][0] >= max(PLACES * TILE, ROW)
    assert needs.NEEDS["tess_level"][0] == 2 ** (layout.SIZES - 1)


@pytest.mark.parametrize("name", needs.NEEDS)
def test_a_limit_that_is_too_low_is_told_in_a_few_words(ctx, name):
    limits = gl.limits(ctx)
    assert not list(needs.lacking(limits))
    least, what = needs.NEEDS[name]
    (told,) = needs.lacking(limits | {name: least - 1})
    assert f"{least - 1:,} {what}" in told and f"{least:,} are needed" in told


def test_a_driver_that_lacks_two_things_is_refused_in_one_line(ctx, monkeypatch):
    monkeypatch.setattr(selftest, "_passed", set())
    more = {"image_units": (1000, "image units"), "tess_level": (10**6, "segments of a tessellated edge")}
    monkeypatch.setattr(needs, "NEEDS", needs.NEEDS | more)
    with pytest.raises(TerrainError, match="image units, and 1,000 are needed; has .* edge, and 1,000,000 are") as told:
        selftest.check_driver(ctx)
    assert "\n" not in str(told.value) and "update the graphics driver" in str(told.value)


# --- Storage blocks: drivers of some cards hold 128 MiB ---------------------------------------------------------------

BLOCK_BYTES = 2**27
NAMED = re.findall(
    r"^\| `[^`]+\.(?:hgt|tif|png)` \| (\d+)(?:²| × (\d+)),",
    (Path(__file__).parents[1] / "docs/maps.md").read_text("utf-8"),
    re.M,
)


def largest_block(cols, rows):
    """Bytes of the largest table of a map in memory."""
    light = (4 * table.words for table in tables_of(cols, rows).values())
    return max(*sizes(layout.levels_over(cols, rows)).values(), *light)


def test_the_sizes_are_those_of_the_buffers_that_are_made(ctx):
    with Renderer(Heightmap(rough(70, 90), 10.0), (96, 54), ctx=ctx) as renderer:
        renderer.draw(Camera.default(renderer.heightmap), style="shaded")
        with renderer.session:
            made = {name: getattr(renderer.tables, name).size for name in sizes(renderer.terrain.levels)}
            assert made == sizes(renderer.terrain.levels)
            lighting = renderer.picture.lighting
            sky, sun = lighting.visibility.sky, lighting.visibility.sun
            light = [part.buffer.size for part in (lighting.lobes, sun, lighting.sums, sky)]
    assert light == [4 * table.words for table in tables_of(90, 70).values()]


@pytest.mark.parametrize(("cols", "rows"), [(int(cols), int(rows or cols)) for cols, rows in NAMED])
def test_a_map_of_our_measurements_fits_or_goes_to_a_store(cols, rows):
    assert largest_block(cols, rows) <= BLOCK_BYTES or cols * rows >= PAYS_POSTS


@pytest.mark.parametrize("side", [3699, 3000, 2049, 1200, 900, 857])
def test_every_map_that_is_held_in_memory_fits(side):
    long = min((PAYS_POSTS - 1) // side, 16385)
    assert largest_block(long, side) <= BLOCK_BYTES and largest_block(side, long) <= BLOCK_BYTES


def test_some_map_fits_not():
    assert len(NAMED) == 7 and largest_block(4097, 4097) > BLOCK_BYTES
