"""Time the error tables of a map, level by level, and compare with a pass that only reads the same posts.

The floor of a level is a compute shader with the same threads that reads every post of the level's nodes once and keeps
the highest. A node's errors need four diagonals, four wedges and its cut edges at each of these posts.

Run: python benchmarks/error_tables.py [MAP]    by default 4097 posts a side of the bundled range, mirrored. Each number
is the best of three in one run: compare ratios, not milliseconds.
"""

import sys

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
REPEATS = 3


class Reading(ComputePass):
    """A pass whose text is made here."""

    def __init__(self, ctx):
        text = shaders.source("blocks/terrain.glsl") + READING
        super(ComputePass, self).__init__(ctx, ctx.compute_shader(text), "READING", text)


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
    tables, kernel = ErrorTables(terrain), Reading(ctx)
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


if __name__ == "__main__":
    main()
