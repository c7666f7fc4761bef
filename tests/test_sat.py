"""Summed-area tables against Python integers: every box of small maps, random boxes of a large one, overflow."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from terrain_gl import reference
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.gpu import gl
from terrain_gl.sat import INT64, STRIP, WHOLE, SummedAreaTables, Table

pytestmark = pytest.mark.line

BITS = (8, 32, 64)
SMALL = [(1, 1), (1, 6), (6, 1), (12, 19), (49, 2)]  # rows, cols
LARGE = [(100, 300), (1000, 37), (4097, 33), (STRIP, STRIP + 1), (2 * STRIP, 2 * STRIP - 1)]


@pytest.fixture(scope="module", params=["strips", "whole lines", "without 64-bit integers"])
def tables(session_context, request):
    """The kernels of each word size, as GPUs and as software renderers with and without 64-bit integers run them."""
    with session_context, pytest.MonkeyPatch.context() as patch:
        if request.param == "without 64-bit integers":
            patch.setattr("terrain_gl.sat.INT64", "an extension that no driver has")
        elif request.param == "whole lines" and INT64 not in session_context.extensions:
            pytest.skip(f"the driver has no {INT64}")
        strip = STRIP if request.param == "strips" else WHOLE
        yield {bits: SummedAreaTables(session_context, bits, strip) for bits in BITS}


def random_words(shape, bits, seed=0):
    """Words of all sizes; those of 8 bits four by four."""
    rng = np.random.default_rng(seed)
    return rng.integers(0, 2**bits, shape + ((32 // bits,) if bits < 32 else ()), dtype=f"u{bits // 8}")


def built(ctx, tables, values):
    """Table of values (layers, rows, cols), its buffer and its kernels."""
    bits = 8 * values.itemsize
    table = Table(values.shape[2], values.shape[1], values.shape[0])
    buffer = ctx.buffer(values.tobytes())
    tables[bits].build(buffer, table)
    return tables[bits], buffer, table


def all_boxes(rows, cols):
    x0, y0, x1, y1 = np.mgrid[: cols + 1, : rows + 1, : cols + 1, : rows + 1].reshape(4, -1)
    return np.stack([x0, y0, x1, y1], 1)[(x0 <= x1) & (y0 <= y1)]


def random_boxes(rows, cols, count=300):
    rng = np.random.default_rng(1)
    x, y = np.sort(rng.integers(0, cols + 1, (count, 2))), np.sort(rng.integers(0, rows + 1, (count, 2)))
    return np.stack([x[:, 0], y[:, 0], x[:, 1], y[:, 1]], 1)


def plain_sums(values, boxes, bits):
    """Box sums of values (rows, cols) by Python integers, modulo 2^bits."""
    rows = values.tolist()
    return [sum(sum(row[x0:x1]) for row in rows[y0:y1]) % 2**bits for x0, y0, x1, y1 in boxes.tolist()]


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("shape", [*SMALL, LARGE[-2]], ids=str)
def test_boxes_equal_python_integers(ctx, tables, sample, shape, bits):
    values = random_words((1, *shape), bits)
    boxes = sample(all_boxes(*shape), 5) if shape in SMALL else random_boxes(*shape)
    kernels, buffer, table = built(ctx, tables, values)
    got = kernels.box_sums(buffer, table, boxes)
    sums, parts = got.reshape(len(boxes), -1), values[0].reshape(*shape, -1)
    assert sums.shape[1] == max(1, 32 // bits)
    for k in range(sums.shape[1]):
        assert sums[:, k].tolist() == plain_sums(parts[..., k], boxes, bits)


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("shape", SMALL + LARGE, ids=str)
def test_words_equal_the_reference(ctx, tables, shape, bits):
    values = random_words((3, *shape), bits, seed=2)
    kernels, buffer, table = built(ctx, tables, values)
    words = kernels.read(buffer, table)
    assert (words == [reference.sat(layer) for layer in values]).all()


@given(st.integers(1, 140), st.integers(1, 140), st.integers(1, 3), st.sampled_from([32, 64]), st.integers(0, 99))
def test_any_size_equals_the_reference(ctx, tables, rows, cols, layers, bits, seed):
    values = random_words((layers, rows, cols), bits, seed)
    kernels, buffer, table = built(ctx, tables, values)
    assert (kernels.read(buffer, table) == [reference.sat(layer) for layer in values]).all()
    buffer.release()


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("width", [40, 41])
def test_columns_summed_in_several_runs_equal_the_reference(ctx, tables, monkeypatch, width, bits):
    """Also if they are summed four at a time, as in large tables of a suitable width."""
    monkeypatch.setattr("terrain_gl.sat.LOOPS", 7)  # 16 rows in a run
    for size in ("SMALL", "LARGE"):
        monkeypatch.setattr(f"terrain_gl.sat.{size}", 0)
    values = random_words((2, 103, width), bits)
    kernels, buffer, table = built(ctx, tables, values)
    assert (kernels.read(buffer, table) == [reference.sat(layer) for layer in values]).all()


def test_long_columns_of_wide_bands_are_summed_to_their_ends(ctx, tables, monkeypatch):
    """If one run of the shader summed all 4,200 rows, llvmpipe would silently end its loop before the last rows."""
    monkeypatch.setattr("terrain_gl.sat.BANDS", 1)
    values = random_words((1, 4200, 1025), 32)
    kernels, buffer, table = built(ctx, tables, values)
    assert (kernels.read(buffer, table)[0] == reference.sat(values[0])).all()


def test_reference_boxes_equal_python_integers():
    values = random_words((12, 19), 32)
    boxes = all_boxes(12, 19)
    table = reference.sat(values)
    assert [reference.box_sum(table, (a, b), (c, d)) for a, b, c, d in boxes.tolist()] == plain_sums(values, boxes, 32)


def test_16_bit_values_in_32_bit_words_stay_exact_after_many_wraps(ctx, tables):
    values = np.full((1, 1500, 1300), 65535, "u4")  # sums to 29 times 2^32
    kernels, buffer, table = built(ctx, tables, values)
    corners = random_boxes(1500 - 256, 1300 - 256)[:, :2]
    boxes = np.concatenate([corners, corners + 256], 1)  # 65,536 texels, the most that is exact
    assert set(kernels.box_sums(buffer, table, boxes).tolist()) == {65535 * 65536}


def test_parts_of_a_word_do_not_disturb_each_other(ctx, tables):
    """A counter of ones between two sums that wrap: no carry and no borrow goes from one part of a word to another."""
    most, ones = np.full((1, 90, 90), 255), np.ones((1, 90, 90))
    values = np.stack([most, ones, ones, most], -1).astype("u1")
    kernels, buffer, table = built(ctx, tables, values)
    texels = 77 * 80
    expected = [-texels, texels, texels, -texels]
    got = kernels.box_sums(buffer, table, np.array([[3, 5, 80, 85]]))
    assert got.tolist() == [[n % 256 for n in expected]]


def test_8_bit_counts_are_exact_up_to_255_and_wrap_above(ctx, tables):
    """This is why glsl/error/bound.glsl divides large boxes into parts of 15 × 15 tiles."""
    kernels, buffer, table = built(ctx, tables, np.ones((1, 64, 64, 4), "u1"))
    boxes = np.array([[7, 9, 7 + 15, 9 + 15], [0, 0, 51, 5], [16, 16, 32, 32], [0, 0, 64, 64]])
    assert kernels.box_sums(buffer, table, boxes)[:, 0].tolist() == [225, 255, 0, 0]


def test_layer_is_chosen_by_number(ctx, tables):
    values = random_words((5, 20, 30), 32)
    kernels, buffer, table = built(ctx, tables, values)
    boxes = random_boxes(20, 30, 40)
    for layer in range(5):
        assert kernels.box_sums(buffer, table, boxes, layer).tolist() == plain_sums(values[layer], boxes, 32)


def test_table_inside_a_larger_buffer_leaves_the_rest_alone(ctx, tables):
    words = random_words((1000,), 64)
    buffer = ctx.buffer(words.tobytes())
    table = Table(20, 30, first=150)
    tables[64].build(buffer, table)
    assert (tables[64].read(buffer, table)[0] == reference.sat(words[150:750].reshape(30, 20))).all()
    around = np.frombuffer(buffer.read(), "u8")
    assert (around[:150] == words[:150]).all() and (around[750:] == words[750:]).all()


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("x, y, cols, rows", [(0, 0, 150, 90), (149, 89, 1, 1), (0, 0, 1, 1), (60, 20, 70, 65)])
def test_edit_equals_a_rebuild(ctx, tables, x, y, cols, rows, bits):
    before, new = random_words((2, 90, 150), bits, 3), random_words((2, rows, cols), bits, 4)
    kernels, buffer, table = built(ctx, tables, before)
    kernels.edit(buffer, table, ctx.buffer(new.tobytes()), Table(cols, rows, 2), x, y)
    after = before.copy()
    after[:, y : y + rows, x : x + cols] = new
    rebuilt = built(ctx, tables, after)[1]
    assert buffer.read() == rebuilt.read()


def test_same_values_give_the_same_bytes(ctx, tables):
    values = random_words((1, 700, 900), 64)
    assert len({built(ctx, tables, values)[1].read() for _ in range(3)}) == 1


def test_table_that_does_not_fit_is_refused(ctx, tables):
    buffer = ctx.buffer(reserve=400)
    for table in (Table(10, 11), Table(0, 5), Table(10, 10, first=1), Table(5, 5, 5)):
        with pytest.raises(ValueError, match="does not fit a buffer of 400 bytes"):
            tables[32].build(buffer, table)
    with pytest.raises(ValueError, match="does not lie in"):
        tables[32].edit(buffer, Table(10, 10), ctx.buffer(reserve=4), Table(1, 1), 10, 0)


def test_driver_with_small_storage_blocks_is_named(ctx, monkeypatch):
    monkeypatch.setattr("terrain_gl.gpu.gl.storage_block_bytes", lambda _: 1 << 20)
    with pytest.raises(TerrainError, match=r"a table of 2 MiB is more .* storage blocks hold \(1 MiB\)"):
        gl.reserve(ctx, 2 << 20, "a table")


def test_word_size_is_checked(ctx):
    with pytest.raises(ValueError, match="expected 8, 32 or 64, got 12"):
        SummedAreaTables(ctx, 12)
