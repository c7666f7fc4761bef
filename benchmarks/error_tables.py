"""Time the error tables of a map, level by level, and compare with a pass that only reads the same posts.

The floor of a level is a compute shader with the same threads that reads every post of the level's nodes once and keeps
the highest. A node's errors need four diagonals, four wedges and its cut edges at each of these posts.

The last line has the processor time of all tables, also of the first time, with an empty cache of shaders if
MESA_SHADER_CACHE_DIR names an empty folder; and their floor: the heights are read once, every table is written
once, at the speed of a kernel that copies as many bytes.

Run: python benchmarks/error_tables.py [MAP]    by default 4097 posts a side of the bundled range, mirrored. Each number
is the best of three in one run: compare ratios, not milliseconds.
"""

import sys
import time
from collections.abc import Callable

import numpy as np
from sat import best_ms
from scale import mirrored

import terrain_gl as tg
from terrain_gl.error import FINE_LEVELS, ErrorTables
from terrain_gl.files.maps import open_map
from terrain_gl.gpu import shaders
from terrain_gl.gpu.context import create_context
from terrain_gl.gpu.passes import ComputePass
from terrain_gl.terrain import Terrain

READING = """
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) writeonly buffer Highest { float highest[]; };
uniform int u_which_level;
uniform ivec2 u_count;
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, u_count))) return;
    ivec2 low = at << u_which_level, high = min(low + (1 << u_which_level), u_last_post);
    float most = 0.0;
    for (int y = low.y; y <= high.y; y++)
        for (int x = low.x; x <= high.x; x++) most = max(most, height_m(ivec2(x, y)));
    highest[at.y * u_count.x + at.x] = most;
}
"""
COPYING = """
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer From { uvec4 from_[]; };
layout(std430, binding = 1) writeonly buffer Into { uvec4 into_[]; };
uniform int u_words;
void main() {
    uint i = gl_GlobalInvocationID.y * 65472u + gl_GlobalInvocationID.x;
    if (i < uint(u_words)) into_[i] = from_[i];
}
"""
REPEATS = 3


class Written(ComputePass):
    """A pass whose text is made here."""

    def __init__(self, ctx, text):
        text = shaders.source("blocks/terrain.glsl") + text
        super(ComputePass, self).__init__(ctx, lambda: ctx.compute_shader(text), "a pass of this benchmark", (text,))


def processor_s(work: Callable[[], object], finish: Callable[[], object]) -> float:
    """Least processor seconds of some work, of all threads."""
    times = []
    for _ in range(REPEATS + 1):  # the first one compiles
        started = time.process_time()
        work()
        finish()
        times.append(time.process_time() - started)
    return min(times[1:])


def copying_s(ctx, terrain, size):
    """Processor seconds to read and write, together, `size` bytes."""
    kernel, words = Written(ctx, COPYING), size // 32
    blocks = {**terrain.resources, "From": ctx.buffer(reserve=16 * words), "Into": ctx.buffer(reserve=16 * words)}
    groups = 1023, -(-words // 65472), 1
    return processor_s(lambda: kernel.run(groups, blocks, {"words": words}), ctx.finish)


def floor_ms(ctx, terrain, kernel, level):
    """Milliseconds to read the posts of a level: in its nodes, or in the blocks of 32 × 32 posts of large nodes."""
    level = min(level, FINE_LEVELS)
    columns, rows = terrain.levels[level].size
    highest = ctx.buffer(reserve=4 * columns * rows)
    read, asked = {**terrain.resources, "Highest": highest}, {"which_level": level, "count": (columns, rows)}
    ms = best_ms(lambda: kernel.run((-(-columns // 8), -(-rows // 8), 1), read, asked), ctx.finish, REPEATS)
    highest.release()
    return ms


def main():
    """Print a line for each level, and the sums."""
    if len(sys.argv) > 1:
        heightmap = open_map(sys.argv[1])[0]
    else:
        land = open_map("alpine-30m")[0]
        heightmap = tg.Heightmap(np.ascontiguousarray(mirrored(land.heights, 4097)), land.spacing_m)
    ctx = create_context()
    terrain = Terrain(ctx, heightmap)
    started = time.process_time()
    tables, kernel = ErrorTables(terrain), Written(ctx, READING)
    ctx.finish()
    first_s = time.process_time() - started
    print(f"{heightmap.cols} x {heightmap.rows} posts on {ctx.info['GL_RENDERER']}")
    print(f"{'level':>5} {'errors ms':>10} {'sums ms':>8} {'floor ms':>9} {'errors/floor':>13}")
    total = np.zeros(3)
    for level in range(1, len(terrain.levels)):
        nodes = (0, 0, *terrain.levels[level].size)
        errors = best_ms(lambda: tables._update_nodes(level, nodes, terrain.all_posts), ctx.finish, REPEATS)  # noqa: B023
        sums = best_ms(lambda: tables._update_tables(level, terrain.all_posts), ctx.finish, REPEATS)  # noqa: B023
        floor = floor_ms(ctx, terrain, kernel, level)
        total += errors, sums, floor
        print(f"{level:5} {errors:10.1f} {sums:8.1f} {floor:9.1f} {errors / floor:13.1f}", flush=True)
    print(f"{'sum':>5} {total[0]:10.1f} {total[1]:8.1f} {total[2]:9.1f} {total[0] / total[2]:13.1f}")
    size = 4 * heightmap.rows * heightmap.cols + tables.bytes
    all_s, floor_s = processor_s(tables.build, ctx.finish), copying_s(ctx, terrain, size)
    floor = f"{size / 2**20:.0f} MiB read and written: {floor_s:.3f} s, so {all_s / floor_s:.0f} times"
    print(f"processor: {all_s:.2f} s, {first_s:.2f} s the first time; {floor}")


if __name__ == "__main__":
    main()
