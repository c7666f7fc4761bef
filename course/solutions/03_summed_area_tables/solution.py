"""Lesson 3: summed-area tables by parallel prefix sums.

Values are unsigned 32-bit whole numbers. Their sums wrap: 2^32 is 0 again. A strip has STRIP values; the last may have
fewer.
"""

import numpy as np

STRIP = 64


def reduce(values, strip=STRIP):
    """3.1 The sum of each strip of each row.

    values    (rows, n) uint32; n need not be a multiple of strip
    returns   (rows, strips) uint32, wrapped; strips = n / strip, rounded up
    """
    # solution
    rows, n = values.shape
    padded = np.zeros((rows, -(-n // strip) * strip), np.uint32)
    padded[:, :n] = values
    return padded.reshape(rows, -1, strip).sum(2, dtype=np.uint32)
    # end


def scan(sums):
    """3.2 For each strip, the sum of all strips to its left.

    sums      (rows, strips) uint32
    returns   (rows, strips) uint32; the first column is 0
    """
    # solution
    before = np.zeros_like(sums)
    for i in range(1, sums.shape[1]):
        before[:, i] = before[:, i - 1] + sums[:, i - 1]
    return before
    # end


def propagate(values, before, strip=STRIP):
    """3.3 The running sum along each row: in every strip it begins with the sum of the strips before.

    values    (rows, n) uint32
    before    (rows, strips) uint32
    returns   (rows, n) uint32; entry i is the sum of the values 0 to i
    """
    # solution
    table = np.empty_like(values)
    for s in range(before.shape[1]):
        part = values[:, s * strip : (s + 1) * strip]
        table[:, s * strip : (s + 1) * strip] = before[:, s : s + 1] + np.cumsum(part, 1, dtype=np.uint32)
    return table
    # end


def sat(values):
    """3.4 The summed-area table: along the rows, then along the columns, with your three functions.

    values    (rows, cols) uint32
    returns   (rows, cols) uint32; entry [y, x] is the sum of values[: y + 1, : x + 1]
    """
    # solution
    along = propagate(values, scan(reduce(values)))
    turned = np.ascontiguousarray(along.T)
    return propagate(turned, scan(reduce(turned))).T
    # end


def box_sums(table, boxes):
    """3.5 Sums over boxes, four fetches each.

    table     (rows, cols) uint32, of `sat`
    boxes     (n, 4) whole numbers x0, y0, x1, y1: columns x0 to x1 - 1, rows y0 to y1 - 1
    returns   (n,) uint32
    """
    # solution
    padded = np.pad(table, ((1, 0), (1, 0)))
    x0, y0, x1, y1 = boxes.T
    return padded[y1, x1] - padded[y0, x1] - padded[y1, x0] + padded[y0, x0]
    # end


def shaders():
    """3.6 The same three steps as compute shaders, one invocation for one strip of one line."""
    return {"reduce": COMMON + REDUCE, "scan": COMMON + SCAN, "propagate": COMMON + PROPAGATE}


COMMON = """
#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Words { uint word[]; };
layout(std430, binding = 1) buffer StripSums { uint strip_sum[]; };
uniform uint u_lines;      // lines: rows, or columns
uniform uint u_length;     // words in a line
uniform uint u_line_step;  // words from a line to the next
uniform uint u_word_step;  // words from a word to the next of its line
const uint STRIP = 64u;
uint strips() { return (u_length + STRIP - 1u) / STRIP; }
uint word_index(uint line, uint i) { return line * u_line_step + i * u_word_step; }
uint strip_index(uint line, uint strip) { return strip * u_lines + line; }
"""

# Write the sum of the strip's words to strip_sum[strip_index(line, strip)].
REDUCE = """
void main() {
    uint line = gl_GlobalInvocationID.x, strip = gl_GlobalInvocationID.y;
    if (line >= u_lines) return;
    // solution
    uint sum = 0u;
    uint end = min((strip + 1u) * STRIP, u_length);
    for (uint i = strip * STRIP; i < end; i++) sum += word[word_index(line, i)];
    strip_sum[strip_index(line, strip)] = sum;
    // end
}
"""

# One invocation a line: replace each strip's sum by the sum of the strips before it. This is done for you.
SCAN = """
void main() {
    uint line = gl_GlobalInvocationID.x;
    if (line >= u_lines) return;
    uint before = 0u;
    for (uint strip = 0u; strip < strips(); strip++) {
        uint sum = strip_sum[strip_index(line, strip)];
        strip_sum[strip_index(line, strip)] = before;
        before += sum;
    }
}
"""

# Replace each word of the strip by the running sum of its line.
PROPAGATE = """
void main() {
    uint line = gl_GlobalInvocationID.x, strip = gl_GlobalInvocationID.y;
    if (line >= u_lines) return;
    // solution
    uint sum = strip_sum[strip_index(line, strip)];
    uint end = min((strip + 1u) * STRIP, u_length);
    for (uint i = strip * STRIP; i < end; i++) {
        sum += word[word_index(line, i)];
        word[word_index(line, i)] = sum;
    }
    // end
}
"""
