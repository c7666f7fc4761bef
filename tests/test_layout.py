"""Layouts: numpy dtypes against the GLSL blocks, by size and by a round trip of every field."""

import numpy as np
import pytest

from terrain_gl import error, layout, shaders

UNIFORM_BLOCKS = {
    "Terrain": (layout.TERRAIN, "blocks/terrain.glsl", 0),
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


def test_node_round_trip(ctx):
    nodes = np.zeros(3, layout.NODE)
    nodes["max_m"], nodes["rms_m"] = [[1, 2], [3, 4], [5, 6]], [[7, 8], [9, 10], [11, 12]]
    nodes["range"] = [[1, 2], [3, 4], [0, 65535]]
    nodes["whole"], nodes["split"] = np.arange(12).reshape(3, 4), 255 - np.arange(12).reshape(3, 4)
    buffer = ctx.buffer(nodes.tobytes())
    declaration = "layout(std430, binding = 0) readonly buffer Nodes { PackedNode node[]; };\n"
    fields = ["unpackHalf2x16(node[{}].max_m)", "unpackHalf2x16(node[{}].rms_m)"]
    floats = [f"floatBitsToUint({text.format(i)}[{k}])" for i in range(3) for text in fields for k in (0, 1)]
    ranges = [f"node[{i}].range {op}" for i in range(3) for op in ("& 0xffffu", ">> 16")]
    shares = [f"node[{i}].{name}" for i in range(3) for name in ("whole", "split")]
    source = shaders.source("error/nodes.glsl") + declaration + writes(floats + ranges + shares)
    got = read_back(ctx, source, 24, lambda _: buffer.bind_to_storage_buffer(0))
    assert got[:12].view("f4").tolist() == list(np.stack([nodes["max_m"], nodes["rms_m"]], 1).ravel())
    assert got[12:18].tolist() == nodes["range"].ravel().tolist()
    assert got[18:].tolist() == np.concatenate([nodes["whole"], nodes["split"]], 1).view("<u4").ravel().tolist()


def test_summary_round_trip(ctx):
    record, sent = random_record(layout.SUMMARY)
    buffer = ctx.buffer(sent.tobytes() + bytes(64))
    expressions = [f"s_count[{i}]" for i in range(8)] + ["s_triangles", "s_splits", "s_worst_px"]
    expressions += [
        "floatBitsToUint(s_price)",
        *(f"s_groups[{i}][{k}]" for i in range(layout.MAX_LEVELS) for k in range(4)),
        *(f"s_groups_of_words[{k}]" for k in range(4)),
    ]
    expressions += [f"floatBitsToUint(s_{end}[{i}])" for end in ("cheap", "dear") for i in (0, 1)]
    expressions += ["s_budget", "s_rounds", "uint(s_side)", "s_asked"]
    assert len(expressions) * 4 == layout.SUMMARY.itemsize
    source = shaders.source("lod/summary.glsl") + writes(expressions)
    got = read_back(ctx, source, len(expressions), lambda _: buffer.bind_to_storage_buffer(4))
    assert (got == sent).all()
    assert got[10:12].view("f4").tolist() == [record["worst_px"], record["price"]]


def test_patch_round_trip(ctx):
    shape = 9 | 5 << 4 | 0b0110 << 8 | 1 << 12
    patch = np.array([((0xABC, 0xFFF0), shape)], layout.PATCH)
    x, y = patch.view("u4")
    lattice = f"lattice_of(uvec2({x}u, {y}u))"
    names = ("corner.x", "corner.y", "step_log2", "segments", "split_edges", "fan")
    expressions = [f"uint({lattice}.{name})" for name in names]
    got = read_back(ctx, shaders.source("mesh/lattice.glsl") + writes(expressions), 6, lambda _: None)
    assert got.tolist() == [0xABC, 0xFFF0, 9, 32, 0b0110, 1]


def test_gathered_record_has_the_size_that_python_reserves(ctx):
    buffer = ctx.buffer(bytes(3 * error.GATHERED_BYTES))
    main = "layout(local_size_x = 1) in;\nvoid main() { block_of[0].split[3] = 1u; block_of[1].max_q = 7u; }\n"
    shader = ctx.compute_shader(shaders.source("error/coarse.glsl") + main)
    buffer.bind_to_storage_buffer(1)
    shader.run()
    got = np.frombuffer(buffer.read(), "u4")
    assert np.flatnonzero(got).tolist() == [error.GATHERED_BYTES // 4 - 1, error.GATHERED_BYTES // 4]


def test_constants_agree_with_the_shaders():
    text = shaders.source("lod/patches.comp") + shaders.source("error/bound.glsl")
    for name in ("MAX_LEVELS", "TILE", "SIZES", "CLASSES", "COUNT_TILE"):
        assert f"#define {name} {getattr(layout, name)}\n" in text.replace("  ", " ").replace(" \n", "\n"), name


@pytest.mark.parametrize(
    "size", [(2, 2), (3, 3), (2, 7), (4, 1000), (65, 65), (66, 65), (1024, 700), (16384, 16384)], ids=str
)
def test_quadtree_covers_the_map_without_overlap(size):
    levels = layout.quadtree(*size)
    cells = [n - 1 for n in size]
    assert levels[0].size == tuple(cells)
    assert levels[-1].size == (1, 1)
    assert len(levels) <= layout.MAX_LEVELS
    assert len(levels) == 2 or max(cells) > 1 << (len(levels) - 2), "no level more than needed"
    for j, level in enumerate(levels):
        assert level.size == tuple(-(-n // 2**j) for n in cells)
    for fine, coarse in zip(levels[1:], levels[2:], strict=False):
        assert coarse.first_node == fine.first_node + fine.nodes
        assert coarse.first_word == fine.first_word + fine.words
        tiles = fine.counts[0] * fine.counts[1]
        assert coarse.first_count == fine.first_count + tiles * layout.CLASSES // 2
