"""Small shader functions and uniform blocks, compared with their Python twins."""

import numpy as np
import pytest
from asking import ask
from test_layout import member, members, read_back, writes

from terrain_gl import reference
from terrain_gl.comparison import clipmap, tessellated
from terrain_gl.gpu import layout, shaders
from terrain_gl.light.gaussians import LIGHTS, LOBE
from terrain_gl.light.horizon import sun_uniforms

RNG = np.random.default_rng(2)


def test_marks_of_posts_are_the_terrains(ctx):
    """Shares of voids and of water, bilinear between four posts."""
    marks = np.array([[0, layout.VOID], [layout.WET, layout.VOID | layout.WET]], "u1")
    texture, block = ctx.texture((2, 2), 1, marks.tobytes(), dtype="u1", alignment=1), np.zeros((), layout.TERRAIN)
    block["last_post"], block["has_voids"] = 1, 1
    buffer, at = ctx.buffer(block.tobytes()), RNG.uniform(0, 1, (50, 2))
    asked, read = np.concatenate([at, at], 1), {"u_marks": texture, "Terrain": buffer}
    statement, marked = "return vec4(marked_at(a.xy), 0.0, 0.0);", {"MARKED": "true"}
    got = ask(ctx, "shade/marks.glsl", statement, asked, defines=marked, resources=read)
    assert got[:, :2] == pytest.approx(at, abs=1e-5)  # voids lie east, water south


def test_inverse_square_root_to_the_bit(ctx):
    x = np.r_[10.0 ** RNG.uniform(-6, 6, 500), 1.0, 4.0].astype("f4")
    got = ask(ctx, "generate/exact.glsl", "return vec4(inverse_sqrt(a.x));", x[:, None].repeat(4, 1))[:, 0]
    assert np.array_equal(got.astype("f4"), reference.generate.inverse_sqrt(x))
    assert got == pytest.approx(x.astype("f8") ** -0.5, rel=1e-6)


def test_stripes_to_the_bit(ctx):
    at, turn = RNG.uniform(-40, 40, (300, 2)).astype("f4"), RNG.uniform(0, 2 * np.pi, 300)
    across = np.stack([np.cos(turn), np.sin(turn)]).astype("f4")
    statement = "return vec4(stripes(a.xy, a.zw, 43u), 0.0, 0.0);"
    got = ask(ctx, "generate/gully.glsl", statement, np.concatenate([at, across.T], 1), uniforms={"seed": 7})[:, :2]
    expected = reference.stripes(at.T[:, None], across[:, None], 7, 43)
    assert np.array_equal(got.astype("f4"), expected[:, 0].T)


def test_strata_to_the_bit(ctx):
    h, at = RNG.uniform(0, 1, 300).astype("f4"), RNG.uniform(-9, 9, (300, 2)).astype("f4")
    statement = "return vec4(strata(a.x, a.yz, 6.0, 1.0 / 6.0, 16.0, a.w, 80u));"
    strength = RNG.uniform(0, 1, 300).astype("f4")
    asked = np.concatenate([h[:, None], at, strength[:, None]], 1)
    got = ask(ctx, "generate/strata.glsl", statement, asked, uniforms={"seed": 7})[:, 0]
    expected = reference.strata(h[None], at.T[:, None], 6, 16, strength[None], 7, 80)
    assert np.array_equal(got.astype("f4"), expected[0])


@pytest.mark.parametrize("elevation", [-0.01, 0.1, 1.2])
def test_share_of_the_suns_disc(ctx, elevation):
    radius = 0.0047
    horizons = elevation + radius * np.linspace(-2, 2, 81)
    sun = sun_uniforms((0.0, np.cos(elevation), np.sin(elevation)), radius)
    asked = np.sin(horizons)[:, None].repeat(4, 1)
    got = ask(ctx, "horizon/disc.glsl", "return vec4(disc_share(a.x));", asked, uniforms=sun)[:, 0]
    # GLSL 4.3 gives asin() 4096 units in the last place; the share's slope is at most 2/π
    step = float(np.spacing(np.float32(abs(elevation) + 2 * radius)))
    slack = 4096 * (2 / np.pi * step / radius + 2.0**-23 / np.pi)
    assert got == pytest.approx(reference.disc_share(elevation, horizons, radius), abs=slack)


BLOCKS = {
    "Lights": (LIGHTS, "light/lights.glsl"),
    "Tessellated": (tessellated.MEASURES, "comparison/tessellated/measures.glsl"),
    "Clipmap": (clipmap.CLIPMAP, "comparison/clipmap/ring.vert"),
    "Rings": (layout.RINGS, "lod/rings/rings.glsl"),
    "Terrain": (layout.TERRAIN, "blocks/terrain.glsl"),
}


def words_of(dtype):
    """GLSL for each word of a block, by its place in the record; padding, named "_", is left out."""
    found = {}
    for name in dtype.names:
        field, first = dtype.fields[name][:2]
        if name == "_" or (name == "pad" and dtype is not LIGHTS):
            continue
        texts = members(np.dtype([(name, field)])) if field.subdtype else [member(f"u_{name}", field, 0)]
        if field.names:
            texts = members(field, f"u_{name}.")
        found |= {first // 4 + i: text for i, text in enumerate(texts) if "pad" not in text or name == "pad"}
    return found


@pytest.mark.parametrize("name", BLOCKS)
def test_block_round_trip(ctx, name):
    dtype, path = BLOCKS[name]
    words = words_of(dtype)
    sent = np.random.default_rng(3).integers(0x3F800000, 0x40000000, dtype.itemsize // 4, dtype="u4")
    block = ctx.buffer(sent.tobytes())
    text = shaders.source(path).split("void main()")[0]
    if path.endswith(".vert"):  # a compute shader has no inputs
        declaration = text[text.index("layout(std140, binding = 4)") :]
        text = shaders.source("comparison/clipmap/pyramid.glsl") + declaration[: declaration.index("};") + 3]

    def bind(shader):
        assert shader[name].size in (dtype.itemsize, dtype.itemsize - 8, dtype.itemsize - 12)
        block.bind_to_uniform_block(shader[name].binding)

    got = read_back(ctx, text + writes(list(words.values())), len(words), bind)
    assert got.tolist() == sent[list(words)].tolist()


def test_a_light_is_three_vectors_and_three_numbers():
    assert LOBE.itemsize == 48 and LIGHTS["sky"].shape == (9,)
