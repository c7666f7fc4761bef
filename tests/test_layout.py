"""Layouts: numpy dtypes against the GLSL blocks, by size and by a round trip of every field."""

import re

import numpy as np
import pytest

from terrain_gl import error, lod
from terrain_gl.comparison import clipmap, tessellated
from terrain_gl.gpu import layout, shaders
from terrain_gl.light import atmosphere, gaussians, horizon, lobes

UNIFORM_BLOCKS = {
    "View": (layout.VIEW, "blocks/view.glsl", 1),
}


def words(dtype):
    """32-bit words of a dtype without padding, and whether they are floats."""
    base, shape = dtype.subdtype or (dtype, ())
    return int(np.prod(shape, dtype=int)), base.kind == "f"


def member(path, dtype, i):
    """GLSL for word i of the block member at `path`, as a uint."""
    count, is_float = words(dtype)
    part = path if count == 1 else f"{path}[{i // 4}][{i % 4}]" if count == 16 else f"{path}[{i}]"
    return f"floatBitsToUint({part})" if is_float else f"uint({part})"


def members(dtype, prefix="u_"):
    """GLSL of every word of a block, in the order of the dtype's fields."""
    for name in dtype.names:
        field = dtype[name]
        if field.subdtype and field.subdtype[0].names:
            for k in range(field.subdtype[1][0]):
                yield from members(field.subdtype[0], f"{prefix}{name}[{k}].")
        else:
            yield from (member(prefix + name, field, i) for i in range(words(field)[0]))


def random_record(dtype, seed=0):
    """Random bits in a dtype without padding; floats stay normal numbers."""
    words = np.random.default_rng(seed).integers(0x3F800000, 0x40000000, dtype.itemsize // 4, dtype="u4")
    return np.frombuffer(words.tobytes(), dtype)[0], words


def read_back(ctx, source, count, bind):
    shader = ctx.compute_shader(source)
    out = ctx.buffer(reserve=4 * count)
    out.bind_to_storage_buffer(7)
    bind(shader)
    shader.run()
    return np.frombuffer(out.read(), "u4")


def writes(expressions):
    lines = "\n".join(f"    out_words[{i}] = {text};" for i, text in enumerate(expressions))
    return (
        "layout(local_size_x = 1) in;\n"
        "layout(std430, binding = 7) writeonly buffer Out { uint out_words[]; };\n"
        f"void main() {{\n{lines}\n}}\n"
    )


@pytest.mark.parametrize("name", UNIFORM_BLOCKS)
def test_uniform_block_round_trip(ctx, name):
    dtype, path, binding = UNIFORM_BLOCKS[name]
    expressions = list(members(dtype))
    assert len(expressions) * 4 == dtype.itemsize, "std140 without padding"
    _, sent = random_record(dtype)
    block = ctx.buffer(sent.tobytes())

    def bind(shader):
        assert shader[name].size == dtype.itemsize
        block.bind_to_uniform_block(binding)

    got = read_back(ctx, shaders.source(path) + writes(expressions), len(expressions), bind)
    assert (got == sent).all()


def test_patch_round_trip(ctx):
    edges = [0, 6, 1, 2]
    word = f"shape_word(11, -5, ivec4{tuple(edges)})"
    of_shape = f"shape_of(ivec4(-8, 0x3ff0, {word}, 0))"
    names = ("corner.x", "corner.y", "side_log2", "step_log2", *(f"edges_log2[{i}]" for i in range(4)))
    expressions = [word, *(f"uint({of_shape}.{name})" for name in names)]
    shape, *got = read_back(
        ctx, shaders.source("mesh/shape.glsl") + writes(expressions), len(expressions), lambda _: None
    ).tolist()
    assert np.array(got, "u4").view("i4").tolist() == [-8, 0x3FF0, 11, -5, *edges]
    record = np.array([((-8, 0x3FF0), shape, 0.5)], layout.PATCH)
    p = layout.unpack_patches(record)
    assert [*p.corner[0], *p.side_log2, *p.step_log2, *p.edges_log2[0]] == [-8, 0x3FF0, 11, -5, *edges]
    assert layout.shape_word(11, -5, 6) == layout.shape_word(11, -5, 0) | 0o6666 << 11
    assert p.size.tolist() == [[1 << 11]] and p.bound_px == 0.5


def test_nodes_decode_as_the_shader_does(ctx):
    nodes = np.array([(1100, 300), (2500, 70)], layout.NODE)
    low_m, span_m, steps = -12.5, 3000.0, np.array([1000, 50000])
    terrain = np.zeros((), layout.TERRAIN)
    terrain["low_m"], terrain["span_m"] = low_m, span_m
    block, buffer = ctx.buffer(terrain.tobytes()), ctx.buffer(nodes.tobytes())
    floats = [f"unpack_errors(node[{i}]).{part}" for part in "xy" for i in (0, 1)]
    floats += [f"unpack_range({steps[0]}u | {steps[1]}u << 16).{part}" for part in "xy"]
    declaration = "layout(std430, binding = 0) readonly buffer Nodes { uint node[]; };\n"
    source = shaders.source("error/nodes.glsl") + declaration + writes([f"floatBitsToUint({text})" for text in floats])

    def bind(_):
        block.bind_to_uniform_block(0)
        buffer.bind_to_storage_buffer(0)

    got = read_back(ctx, source, len(floats), bind)
    ranges = steps * (span_m / 65535) + low_m  # as `ErrorTables.read_ranges` computes heights
    assert got.view("f4") == pytest.approx(np.concatenate([*layout.unpack_nodes(nodes, span_m), ranges]), rel=1e-5)


def test_gathered_record_has_the_size_that_python_reserves(ctx):
    buffer = ctx.buffer(bytes(3 * error.GATHERED_BYTES))
    main = "layout(local_size_x = 1) in;\nvoid main() { contribution[0].voids = 1u; contribution[1].max_m = 7u; }\n"
    shader = ctx.compute_shader(shaders.source("error/coarse.glsl") + main)
    buffer.bind_to_storage_buffer(1)
    shader.run()
    got = np.frombuffer(buffer.read(), "u4")
    assert np.flatnonzero(got).tolist() == [error.GATHERED_BYTES // 4 - 1, error.GATHERED_BYTES // 4]


def glsl_number(path, name):
    """The number that a shader itself defines for a name."""
    text = (shaders.root() / path).read_text(encoding="utf-8")
    return float(re.search(rf"^#define {name} ([-\d.e]+)", text, re.MULTILINE)[1])


# Numbers that a shader has as a default, or defines itself, and that Python has too.
TWICE = [
    ("comparison/clipmap/ring.vert", "BLOCK", clipmap.BLOCK),
    ("comparison/tessellated/levels.comp", "MOST", tessellated.MOST),
    ("light/lights.glsl", "SKY_LOBES", len(gaussians.SKY_AXES)),
    ("light/lobes.glsl", "LOBE_LAYERS", lobes.LAYERS),
    ("horizon/disc.glsl", "SUN_LAYERS", horizon.SUN_LAYERS),
    ("horizon/disc.glsl", "SUN_STEPS", horizon.SUN_STEPS),
    ("horizon/fold.comp", "AZIMUTHS", horizon.AZIMUTHS),
    ("horizon/fold.comp", "SINES", horizon.SINES),
    ("horizon/fold.comp", "COSINES", horizon.COSINES),
    ("horizon/fold.comp", "TEXEL", layout.SKY_TEXEL),
    ("horizon/visible.glsl", "TEXEL", horizon.TEXEL),
    *((f"horizon/{name}", "FULL", horizon.FULL) for name in ("fold.comp", "visible.glsl")),
    *(("blocks/view.glsl", f"METRIC_{name.upper()}", i) for i, name in enumerate((*lod.METRICS, lod.METRES))),
]


@pytest.mark.parametrize("path, name, value", TWICE)
def test_numbers_stated_twice_agree(path, name, value):
    assert glsl_number(path, name) == value


def test_the_weights_of_colours_are_those_of_python():
    text = (shaders.root() / "blocks" / "colour.glsl").read_text(encoding="utf-8")
    weights = re.search(r"LUMINANCE = vec3\((.*)\);", text)[1].split(",")
    assert [float(each) for each in weights] == atmosphere.LUMINANCE.tolist()


def test_shared_sizes_are_stated_in_python_alone():
    for path in shaders.root().rglob("*.*"):
        if path.suffix in (".glsl", ".comp", ".vert", ".tesc", ".tese", ".geom", ".frag"):
            for name in layout.DEFINES:
                assert f"#define {name} " not in path.read_text(encoding="utf-8"), path
    assert all(
        f"#define {name} {value}\n" in shaders.source("lod/rings/cull.comp") for name, value in layout.DEFINES.items()
    )


@pytest.mark.parametrize(
    "size", [(2, 2), (3, 3), (2, 7), (4, 1000), (65, 65), (66, 65), (1024, 700), (16384, 16384)], ids=str
)
def test_nodes_cover_the_map_without_overlap(size):
    levels = layout.levels_over(*size)
    cells = [n - 1 for n in size]
    assert levels[0].size == tuple(cells)
    assert levels[-1].size == (1, 1)
    assert len(levels) <= layout.MAX_LEVELS
    assert len(levels) == 2 or max(cells) > 1 << (len(levels) - 2), "no level more than needed"
    for j, level in enumerate(levels):
        assert level.size == tuple(-(-n // 2**j) for n in cells)
    assert levels[1].first_node == 0, "cells have no record"
    for fine, coarse in zip(levels[1:], levels[2:], strict=False):
        assert coarse.first_node == fine.first_node + fine.nodes
    for fine, coarse in zip(levels, levels[1:], strict=False):
        assert coarse.first_count == fine.first_count + fine.counts[0] * fine.counts[1] * layout.CLASS_WORDS
    for j, level in enumerate(levels):
        assert level.count_tile == (2 if j else 4)
        assert level.counts == tuple(-(-n // level.count_tile) for n in level.size)
