"""Example 11: the whole method in one file
========================================

A metre near the eye is many pixels, a metre far away is none. So land far away needs fewer triangles. How few? A table
answers: four fetches tell whether any cell in a box is off by more than the eye tolerates there.

The real method does more. This file simplifies it:

- The truth is the heights at the posts. Between the posts there is no bound, and no vertex.
- A patch near the eye asks the tables, too, not the few cells that it has.
- A patch has at most 32 segments a side. If a far unit needs more, the certified error is above the tolerance.
- Every box is as high as the whole map. A metre is as many pixels everywhere as in the picture's worst corner.
- The CPU reads the number of patches and divides them into draws. The Earth is flat, and the light is simple.

Run: ``python 11_the_method.py`` for a window, ``python 11_the_method.py PICTURE.png [MAP]`` for a picture
"""

import argparse
import json
import struct
import sys
import zlib
from pathlib import Path
from typing import NamedTuple

import moderngl
import numpy as np

# -- 1. The map: heights in metres at posts; row 0 is the northern edge ------------------------------------------------
GROUND = {  # colours of flat, steep and high land
    "alpine": ((0.050, 0.080, 0.022), (0.150, 0.128, 0.112), (0.70, 0.75, 0.84)),
    "arid": ((0.30, 0.19, 0.11), (0.36, 0.15, 0.07), (0.42, 0.30, 0.18)),
}


class Map(NamedTuple):
    """A heightmap (rows, cols), and a first view of it: east, north and up in metres."""

    heights: np.ndarray
    spacing_m: float
    look: str
    eye: tuple
    target: tuple
    fov_deg: float


def open_map(name):
    """Open a map of `heightmaps/maps.json`."""
    here = globals().get("__file__", sys.argv[0])  # a gallery runs the text without a file
    folder = Path(here).resolve().parent.parent / "heightmaps"
    known = json.loads((folder / "maps.json").read_text())[name]
    heights = np.float32(known["z_offset_m"]) + np.float32(known["z_scale"]) * read_png(folder / known["file"])
    return Map(heights, known["spacing_m"], known["look"], *(known["view"][k] for k in ("eye", "target", "fov")))


def read_png(path):
    """Read a 16-bit grey PNG. Its bytes are differences from a guess by the neighbours west, north and north-west."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        packed += data[at + 8 : at + 8 + length] if kind == b"IDAT" else b""
        at += length + 12
    cols, rows = struct.unpack(">II", data[16:24])
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(rows, 1 + 2 * cols)
    known = np.zeros((rows + 1, cols + 1, 2), np.int16)
    for k in range(rows + cols - 1):  # pixels of a diagonal do not depend on each other
        row = np.arange(max(0, k - cols + 1), min(rows, k + 1))
        west, north, corner = known[row + 1, k - row], known[row, k - row + 1], known[row, k - row]
        nearest = np.argmin([abs(north - corner), abs(west - corner), abs(west + north - 2 * corner)], axis=0)
        guesses = 0 * west, west, north, (west + north) // 2, np.choose(nearest, [west, north, corner])
        stored = lines[:, 1:].reshape(rows, cols, 2)[row, k - row]
        known[row + 1, k - row + 1] = stored + np.choose(lines[row, :1], guesses) & 255
    return np.float32(known[1:, 1:] @ [256, 1])


def write_png(path, pixels):
    """Write (rows, cols, 3) bytes."""
    lines = np.insert(pixels.reshape(len(pixels), -1), 0, 0, axis=1)
    head = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 2, 0, 0, 0)
    chunks = b"IHDR" + head, b"IDAT" + zlib.compress(lines.tobytes(), 3), b"IEND"
    body = b"".join(struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in chunks)
    Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + body)


# -- 2. The table: how many cells of a box are above an error class? ---------------------------------------------------
# Level j draws every 2^j-th post. Each level has a table for each class:
#   S(x, y)   = number of cells (i, j) with i < x, j < y and an error above the class       (Crow 1984; Porikli 2005)
#   box(a, b) = S(b.x, b.y) - S(b.x, a.y) - S(a.x, b.y) + S(a.x, a.y)                       four fetches for any box
TABLES = """
layout(std430, binding = 0) buffer Sums { uint S[]; };
layout(binding = 0) uniform sampler2D u_heights;
float post(int col, int row) { return texelFetch(u_heights, min(ivec2(col, row), LAST), 0).r; }
ivec2 cells_of(int j) { return (LAST - 1 >> j) + 1; }  // columns and rows
int sum_at(int j, int c, int x, int y) {
    return FIRST_SUM[j] + (c * (cells_of(j).y + 1) + y) * (cells_of(j).x + 1) + x;
}
float limit_m(int c) { return 2.0 * SPAN_M * exp2(-0.5 * float(c)); }  // of class c; no error is above class 0
uint cells_above(ivec2 low, int side, int j, int c) {
    ivec2 a = max(low, 0) >> j, b = (min(low + side, LAST) - 1 >> j) + 1;
    if (any(lessThanEqual(b, a))) return 0u;  // beyond the map
    uint south = S[sum_at(j, c, b.x, b.y)] - S[sum_at(j, c, a.x, b.y)];
    uint north = S[sum_at(j, c, b.x, a.y)] - S[sum_at(j, c, a.x, a.y)];
    return south - north;
}
"""

# A cell of level j is two triangles. OpenGL does not say which diagonal they share: we take the worse one, at every
# post of the closed cell. With the twist t = a - b - c + d of its corners, they are  t min(x (1-y), y (1-x))  above and
# t min(x y, (1-x) (1-y))  below the bilinear surface. A finer neighbour cuts an edge of the cell: its new vertices are
# at most `cut` off the straight edge, and move the surface by at most w times that: w is 1 there, 0 at the far side.
ERRORS = """
layout(local_size_x = 8, local_size_y = 8) in;
uniform int u_j;
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID), low = at << u_j, end = min(low + (1 << u_j), LAST), n = end - low;
    if (any(greaterThanEqual(at, cells_of(u_j)))) return;
    float a = post(low.x, low.y), b = post(end.x, low.y), c = post(low.x, end.y), d = post(end.x, end.y);
    vec4 cut = vec4(0.0);  // north, south, west, east
    for (int i = 1; i < max(n.x, n.y); i++) {
        ivec2 k = low + min(ivec2(i), n);
        vec4 h = vec4(post(k.x, low.y), post(k.x, end.y), post(low.x, k.y), post(end.x, k.y));
        cut = max(cut, abs(h - mix(vec4(a, c, a, b), vec4(b, d, c, d), vec4((k - low).xxyy) / vec4(n.xxyy))));
    }
    float error_m = 0.0, t = a - b - c + d;
    for (int y = low.y; y <= end.y; y++) for (int x = low.x; x <= end.x; x++) {
        vec2 p = vec2(ivec2(x, y) - low) / vec2(n), q = 1.0 - p;
        vec4 moves_m = cut * vec4(q.y, p.y, q.x, p.x);
        float off_m = mix(mix(a, b, p.x), mix(c, d, p.x), p.y) - post(x, y);
        off_m = max(abs(off_m + t * min(p.x * q.y, p.y * q.x)), abs(off_m - t * min(p.x * p.y, q.x * q.y)));
        error_m = max(error_m, off_m + max(max(moves_m.x, moves_m.y), max(moves_m.z, moves_m.w)));
    }
    error_m += 1e-6 * max(abs(LOWEST_M), abs(LOWEST_M + SPAN_M));  // rounding
    for (int i = 0; i < CLASSES; i++) S[sum_at(u_j, i, at.x + 1, at.y + 1)] = uint(error_m > limit_m(i));
}
"""
SUMS = """
layout(local_size_x = 8) in;
uniform int u_j;
uniform ivec2 u_along;  // first along rows, then along columns
void main() {
    ivec2 at = u_along.yx * int(gl_GlobalInvocationID.x) + 1;
    for (uint sum = 0u; all(lessThanEqual(at, cells_of(u_j))); at += u_along) {
        int here = sum_at(u_j, int(gl_GlobalInvocationID.y), at.x, at.y);
        S[here] = sum += S[here];
    }
}
"""

# -- 3. From metres to pixels ------------------------------------------------------------------------------------------
# In the camera's axes a point is (x, y, z), z is its depth, and the vertical is v. A point that rises by d moves by
#   K |d| |(v.x - x/z v.z, v.y - y/z v.z)| / (z + d v.z)   pixels.
# The norm is largest in a corner of the picture: u_scale_px is K times that.
VIEW = """
uniform vec3 u_eye;
uniform mat3 u_axes;  // from world metres to right, up, depth
uniform vec2 u_tan;   // x/z and y/z at the picture's edges
uniform float u_scale_px, u_tolerance_px;
vec3 world(ivec2 at, float h) { return vec3(at.x * SPACING_M, (LAST.y - at.y) * SPACING_M, h); }
float tilt() { return abs(u_axes[2].z); }
float error_px(float z, float d) { return z > d * tilt() ? u_scale_px * d / (z - d * tilt()) : FAR; }
float error_within_m(float z) { return 0.9999 * u_tolerance_px * z / (u_scale_px + u_tolerance_px * tilt()); }
float depth_of(ivec2 low, int side) {  // the smallest depth of a box, FAR if it is not in the picture
    ivec2 from = max(low, 0), to = min(low + side, LAST);
    vec3 one = world(from, LOWEST_M), other = world(to, LOWEST_M + SPAN_M), extent = 0.5 * abs(other - one);
    vec3 q = u_axes * (0.5 * (one + other) - u_eye);
    vec3 e = mat3(abs(u_axes[0]), abs(u_axes[1]), abs(u_axes[2])) * extent;
    bool beside = any(greaterThan(abs(q.xy) - e.xy, u_tan * (q.z + e.z)));
    return beside || q.z + e.z < NEAR_M || any(lessThanEqual(to, from)) ? FAR : max(q.z - e.z, NEAR_M);
}
"""

# -- 4. The level of each patch ----------------------------------------------------------------------------------------
# Ring l has 16 × 16 blocks of 8 × 8 units, and a unit has 2 × 2 cells of 2^l posts. The finer ring fills its middle.
# Rings slide with the eye by two units, so their squares need not be nodes of a tree: the table answers for any box.
# A square of 1, 2, 4 or 8 units has the coarsest spacing whose count of cells above the tolerated error is 0. Four
# squares become one where that costs no more. A patch costs its triangles, and 28 more.
LEAVES = """
uniform ivec2 u_origin[RINGS];  // north-west posts; the finest ring is the first
layout(std430, binding = 1) buffer Leaves { int leaves[]; };  // a word for each unit: log2 of side and step
struct Leaf { ivec2 low; int side_log2, step_log2, ring; };   // posts
int unit_at(int ring, ivec2 at) { return (ring * UNITS + at.y) * UNITS + at.x; }
Leaf leaf_over(ivec2 post) {  // the largest leaf that covers the cell south-east of a post
    for (int ring = 0; ring < RINGS; ring++) {
        ivec2 at = post - u_origin[ring] >> ring + 1;
        for (int size = 3; size >= 0 && at == (at & UNITS - 1); size--) {
            ivec2 corner = at >> size << size;
            int word = leaves[unit_at(ring, corner)], side_log2 = word >> 8;
            ivec2 low = u_origin[ring] + (corner << ring + 1);
            if (side_log2 == ring + 1 + size) return Leaf(low, side_log2, word & 255, ring);
        }
    }
    return Leaf(post, 0, 24, RINGS);  // beyond all rings
}
"""
DECIDE = """
layout(local_size_x = 8, local_size_y = 8) in;  // a block
shared float s_cost[8][8];
bool holds(ivec2 low, int side, int j) {
    float allowed_m = error_within_m(depth_of(low, side));
    int c = max(int(ceil(2.0 * log2(2.0 * SPAN_M / allowed_m))), 0);  // the class of that error
    return j <= 0 || c < CLASSES && cells_above(low, side, j, c) == 0u;
}
void main() {
    ivec2 unit = ivec2(gl_LocalInvocationID), at = ivec2(gl_GlobalInvocationID);
    int ring = int(gl_WorkGroupID.z);
    ivec2 low = u_origin[ring] + (at << ring + 1), finer = u_origin[max(ring - 1, 0)];
    for (int size = 0; size <= 3; size++) {
        barrier();
        if (unit != (unit >> size << size)) continue;
        int side_log2 = ring + 1 + size, side = 1 << side_log2, j = min(ring + min(size, 2), TOP);
        while (j > max(side_log2 - 5, 0) && !holds(low, side, j)) j--;
        // An edge has at most 64 segments: no leaf in a box three times as wide may need more. Units meet the finer
        // ring, larger leaves do not: so one of two leaves that meet has the whole edge.
        bool touches = all(lessThanEqual(finer, low + side)) && all(lessThanEqual(low, finer + (UNITS << ring)));
        bool fits = holds(low, side, j) && holds(low - side, 3 * side, side_log2 - 6) && !(ring > 0 && touches);
        float cost = size == 0 || fits ? 28.0 + exp2(2.0 * float(side_log2 - j) + 1.0) : FAR;
        ivec2 a = unit, b = unit + (1 << size >> 1);
        float parts = s_cost[a.y][a.x] + s_cost[a.y][b.x] + s_cost[b.y][a.x] + s_cost[b.y][b.x];
        if (size == 0 || cost <= parts) leaves[unit_at(ring, at)] = side_log2 << 8 | j;
        s_cost[a.y][a.x] = size == 0 ? cost : min(cost, parts);
    }
}
"""

# -- 5. Edges without cracks -------------------------------------------------------------------------------------------
# Where two leaves meet, the longer side is the edge. Its spacing is the finest among all leaves along it, on both
# sides. Both sides compute the same number from the same words, so they have the same vertices.
PATCHES = """
struct Patch { ivec2 low; int side_log2, step_log2; ivec4 edges_log2; };  // log2 of segments: west, north, east, south
layout(std430, binding = 2) buffer Patches { uint certified_px, count; Patch patches[]; };
"""
EMIT = """
layout(local_size_x = 8, local_size_y = 8) in;
Leaf beside(Leaf leaf, int side, int along) {  // the neighbour at a post of a side: 0 west, 1 north, 2 east, 3 south
    int across = side < 2 ? -1 : 1 << leaf.side_log2;
    return leaf_over(leaf.low + (side % 2 == 0 ? ivec2(across, along) : ivec2(along, across)));
}
int edge_step_log2(Leaf leaf, int side) {
    Leaf other = beside(leaf, side, 0);
    bool is_shorter = other.side_log2 > leaf.side_log2;  // then the edge is the other's opposite side
    Leaf longer = is_shorter ? other : leaf;
    int step_log2 = longer.step_log2;
    for (int along = 0; along < 1 << longer.side_log2; along += 1 << other.side_log2) {
        other = beside(longer, is_shorter ? side ^ 2 : side, along);
        step_log2 = min(step_log2, other.step_log2);
    }
    return step_log2;
}
void main() {
    int ring = int(gl_WorkGroupID.z), c = 0;
    ivec2 low = u_origin[ring] + (ivec2(gl_GlobalInvocationID) << ring + 1);
    Leaf leaf = leaf_over(low);
    float depth_m = depth_of(low, 1 << leaf.side_log2);
    if (leaf.ring != ring || leaf.low != low || depth_m == FAR) return;
    Patch p = Patch(low, leaf.side_log2, leaf.step_log2, ivec4(0));
    for (int side = 0; side < 4; side++) p.edges_log2[side] = leaf.side_log2 - edge_step_log2(leaf, side);
    patches[atomicAdd(count, 1u)] = p;
    while (c + 1 < CLASSES && cells_above(low, 1 << leaf.side_log2, leaf.step_log2, c + 1) == 0u) c++;
    if (leaf.step_log2 > 0) atomicMax(certified_px, floatBitsToUint(error_px(depth_m, limit_m(c))));
}
"""

# -- 6. Tessellation: a patch has T × T cells, and segments of its own on each edge -----------------------------------
VERTEX = "flat out int v_patch; void main() { v_patch = gl_VertexID; }"
CONTROL = """
layout(vertices = 1) out;
flat in int v_patch[];
flat out int c_patch[];
void main() {
    Patch p = patches[v_patch[0]];
    c_patch[gl_InvocationID] = v_patch[0];
    for (int side = 0; side < 4; side++) gl_TessLevelOuter[side] = float(1 << p.edges_log2[side]);
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = float(1 << p.side_log2 - p.step_log2);
}
"""
EVALUATION = """
layout(quads, equal_spacing, cw) in;
flat in int c_patch[];
out vec4 v_place;  // world metres, log2 of the spacing
void main() {
    Patch p = patches[c_patch[0]];
    ivec2 at = min(p.low + ivec2(round(gl_TessCoord.xy * float(1 << p.side_log2))), LAST);  // a post
    v_place = vec4(world(at, post(at.x, at.y)), p.step_log2);
    vec3 q = u_axes * (v_place.xyz - u_eye);
    gl_Position = vec4(q.xy / u_tan, q.z - 2.0 * NEAR_M, q.z);
}
"""

# -- 7. The light: an evening sun with shadows, a blue sky, and the air between ----------------------------------------
LIGHT = """
in vec4 v_place;
out vec4 out_colour;
uniform bool u_shows_levels;
float height_m(vec2 post, float lod) { return textureLod(u_heights, (post + 0.5) / vec2(LAST + 1), lod).r; }
vec3 sky(vec3 to) { return mix(vec3(0.66, 0.56, 0.52), vec3(0.08, 0.19, 0.44), 1.0 - exp(-6.0 * max(to.z, 0.0))); }
vec4 film(vec3 light) { return vec4(pow(1.0 - exp(-1.3 * light), vec3(1.0 / 2.2)), 1.0); }
"""
LAND = """
void main() {
    vec2 post = vec2(v_place.x, float(LAST.y) * SPACING_M - v_place.y) / SPACING_M;
    float away_m = distance(v_place.xyz, u_eye), d = max(1.0, away_m / u_scale_px / SPACING_M), lod = log2(d);
    float east = height_m(post + vec2(d, 0), lod) - height_m(post - vec2(d, 0), lod);
    float north = height_m(post - vec2(0, d), lod) - height_m(post + vec2(0, d), lod);
    vec3 n = normalize(vec3(-east, -north, 2.0 * d * SPACING_M));
    float height = (v_place.z - LOWEST_M) / SPAN_M, sun = 1.0;
    vec3 ground = mix(FLAT, STEEP, smoothstep(0.08, 0.30, 1.0 - n.z + 0.3 * smoothstep(0.3, 0.6, height)));
    ground = mix(ground, HIGH, smoothstep(0.45, 0.60, height - 0.5 * (1.0 - n.z)));
    if (u_shows_levels) ground = 0.3 + 0.3 * cos(1.3 * v_place.w + vec3(0.0, 2.1, 4.2));
    for (float s = 1.0; s < 300.0; s *= 1.3) {  // posts towards the sun
        float ray_m = v_place.z + s * SPACING_M * SUN.z / length(SUN.xy);
        float gap_m = ray_m - height_m(post + s * normalize(SUN.xy) * vec2(1, -1), log2(s) - 2.0);
        sun = min(sun, smoothstep(0.0, 1.0, 0.5 + gap_m / SPACING_M / (0.04 * s + 0.2)));
    }
    float open = clamp(0.7 + 0.1 * (v_place.z - height_m(post, 4.0)) / SPACING_M, 0.3, 1.0);  // valleys see less sky
    vec3 lit = ground * (vec3(4.4, 2.8, 1.5) * sun * max(dot(n, SUN), 0.0) + vec3(0.30, 0.42, 0.70) * open);
    float air = 1.0 - exp(-1.6e-5 * away_m * exp(-max(v_place.z - LOWEST_M, 0.0) / 1500.0));
    out_colour = film(mix(lit, 0.75 * sky(vec3(0.0)), air));
}
"""
SCREEN = """
out vec4 v_place;  // a ray
void main() {
    gl_Position = vec4(ivec2(gl_VertexID % 2, gl_VertexID / 2) * 4 - 1, 0.0, 1.0);
    v_place = vec4(vec3(gl_Position.xy * u_tan, 1.0) * u_axes, 0.0);
}
"""
SKY = "void main() { out_colour = film(sky(normalize(v_place.xyz))); }"

# -- 8. The frame ------------------------------------------------------------------------------------------------------
CLASSES = 32
TOP = 7  # level of the coarsest cells
UNITS = 128  # across a ring
MOST_PATCHES = 1 << 17
PATCHES_PER_DRAW = 15  # of 65 × 65 vertices: Mesa's software renderer fails from 65,536 on


def look(eye, forward, fov_deg, size):
    """Uniforms of the camera at `eye` that looks along `forward`; `fov_deg` is its vertical field of view."""
    ahead, right = forward / np.linalg.norm(forward), np.cross(forward, (0, 0, 1))
    right = right / np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, ahead), ahead])
    tan = np.tan(np.radians(fov_deg) / 2) * np.array([size[0] / size[1], 1])
    scale_px = size[1] / 2 / tan[1] * np.linalg.norm(abs(axes[:2, 2]) + tan * abs(axes[2, 2]))
    return {"u_eye": tuple(eye), "u_axes": tuple(axes.T.ravel()), "u_tan": tuple(tan), "u_scale_px": scale_px}


class Terrain:
    """A map on the GPU, its tables, and its shaders."""

    def __init__(self, ctx, map_):
        self.ctx, self.map, (rows, cols) = ctx, map_, map_.heights.shape
        self.sizes = [(-(-(cols - 1) // 2**j), -(-(rows - 1) // 2**j)) for j in range(TOP + 1)]  # cells of each level
        first_sum = np.cumsum([0, 0] + [(x + 1) * (y + 1) * CLASSES for x, y in self.sizes[1:]]).tolist()
        self.rings = 2 + max(0, int(np.ceil(np.log2(max(rows, cols) / (UNITS - 4)))))
        flat, steep, high = (f"vec3{colour}" for colour in GROUND[map_.look])
        self.head = f"""#version 430
            const ivec2 LAST = ivec2({cols - 1}, {rows - 1});
            const int TOP = {TOP}, CLASSES = {CLASSES}, UNITS = {UNITS}, RINGS = {self.rings};
            const int FIRST_SUM[] = int[]{tuple(first_sum)};
            const float SPACING_M = {map_.spacing_m}, NEAR_M = 5.0, FAR = 1e9;
            const float LOWEST_M = {map_.heights.min()}, SPAN_M = {np.ptp(map_.heights) + 1};
            const vec3 SUN = normalize(vec3(-0.9, -0.2, 0.3)), FLAT = {flat}, STEEP = {steep}, HIGH = {high};
            """
        self.head += TABLES + VIEW + LEAVES + PATCHES
        sizes = 4 * first_sum[-1], 4 * UNITS**2 * self.rings, 16 + 32 * MOST_PATCHES
        self.buffers = [ctx.buffer(reserve=n) for n in sizes]
        for binding, buffer in enumerate(self.buffers):
            buffer.bind_to_storage_buffer(binding)
        self.heights = ctx.texture((cols, rows), 1, map_.heights.tobytes(), dtype="f4")
        self.heights.build_mipmaps()
        self.heights.repeat_x = self.heights.repeat_y = False
        self.heights.use(0)
        errors, sums, self.decide, self.emit = map(self.kernel, (ERRORS, SUMS, DECIDE, EMIT))
        self.land = self.program(VERTEX, LIGHT + LAND, CONTROL, EVALUATION)
        self.sky = self.program(SCREEN, LIGHT + SKY)
        self.buffers[0].clear()
        for j, (x, y) in enumerate(self.sizes[1:], 1):
            self.run(errors, {"u_j": j}, -(-x // 8), -(-y // 8))
            self.run(sums, {"u_j": j, "u_along": (1, 0)}, -(-y // 8), CLASSES)
            self.run(sums, {"u_j": j, "u_along": (0, 1)}, -(-x // 8), CLASSES)

    def kernel(self, text):
        """Compile a compute shader."""
        return self.ctx.compute_shader(self.head + text)

    def program(self, vertex, fragment, *tessellation):
        """Compile the stages of a draw without vertex buffers."""
        stages = [self.head + text for text in tessellation]
        program = self.ctx.program(self.head + vertex, self.head + fragment, None, *stages)
        return self.ctx.vertex_array(program, [])

    def run(self, kernel, values, *groups):
        """Run a compute shader, and wait until its results can be read."""
        tell(kernel, values)
        kernel.run(*groups)
        self.ctx.memory_barrier()

    def origins(self, eye):
        """North-west posts of the rings around an eye: even places of their lattices."""
        last = np.array(self.map.heights.shape[::-1]) - 1
        post = np.clip([eye[0] / self.map.spacing_m, last[1] - eye[1] / self.map.spacing_m], 0, last)
        step = 4 << np.arange(self.rings)[:, None]  # two units
        return (step * np.round(post / step - UNITS / 4).astype(int)).tolist()

    def select(self, view, tolerance_px):
        """Choose the patches of a view. Returns the certified error in pixels, and their number."""
        self.buffers[2].clear(size=16)
        for kernel in (self.decide, self.emit):
            values = view | {"u_tolerance_px": tolerance_px, "u_origin": self.origins(view["u_eye"])}
            self.run(kernel, values, UNITS // 8, UNITS // 8, self.rings)
        return struct.unpack("fI", self.buffers[2].read(8))

    def draw_patches(self, array, count):
        """Draw patches in portions."""
        self.ctx.patch_vertices = 1
        for first in range(0, count, PATCHES_PER_DRAW):
            array.render(moderngl.PATCHES, min(PATCHES_PER_DRAW, count - first), first=first)

    def draw(self, target, view, tolerance_px, shows_levels=False):
        """Draw a view, or its wires in the colours of their levels. Returns a line about it."""
        certified_px, count = self.select(view, tolerance_px)
        for array in (self.sky, self.land):
            tell(array.program, view | {"u_shows_levels": shows_levels})
        target.use()
        target.clear()
        self.ctx.enable_only(moderngl.NOTHING)
        self.sky.render(moderngl.TRIANGLES, 3)
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.depth_func = "<"
        self.ctx.wireframe = shows_levels
        with self.ctx.query(primitives=True) as query:
            self.draw_patches(self.land, count)
        self.ctx.wireframe = False
        return f"{query.primitives:,} triangles in {count:,} patches, at most {certified_px:.3f} px off"


def tell(program, values):
    """Set those uniforms that a program has."""
    for name in values.keys() & set(program):
        program[name] = values[name]


# -- 9. A picture, or a window -----------------------------------------------------------------------------------------
def draw_picture(path, map_, size, view, tolerance_px):
    """Draw without a window, with 4 samples a pixel, and write a PNG."""
    ctx = moderngl.create_context(430, standalone=True, backend="egl", libgl="libGL.so.1", libegl="libEGL.so.1")
    samples, picture = ctx.simple_framebuffer(size, 3, samples=4), ctx.simple_framebuffer(size, 3)
    print(Terrain(ctx, map_).draw(samples, view, tolerance_px))
    ctx.copy_framebuffer(picture, samples)
    write_png(path, np.frombuffer(picture.read(), np.uint8).reshape(size[1], size[0], 3)[::-1])
    print("wrote", path)


def open_window(size):
    """Open a window. Returns the module glfw and the window, which is None without a display."""
    import glfw

    glfw.ERROR_REPORTING = False
    if not glfw.init():
        return glfw, None
    hints = {"CONTEXT_VERSION_MAJOR": 4, "CONTEXT_VERSION_MINOR": 3, "OPENGL_PROFILE": glfw.OPENGL_CORE_PROFILE}
    for name, value in (hints | {"RESIZABLE": False, "SAMPLES": 4}).items():
        glfw.window_hint(getattr(glfw, name), value)
    return glfw, glfw.create_window(*size, "The whole method", None, None)


def fly(glfw, window, map_, size, eye, forward, tolerance_px):
    """Fly: W A S D and a dragging mouse, + and - change the tolerance, the space bar shows the levels."""
    glfw.make_context_current(window)
    terrain, pressed = Terrain(moderngl.create_context(430), map_), []
    glfw.set_key_callback(window, lambda _w, key, _code, action, _mods: action and pressed.append(key))
    azimuth, climb = np.arctan2(forward[0], forward[1]), np.arcsin(forward[2] / np.linalg.norm(forward))
    before, mouse = glfw.get_time(), glfw.get_cursor_pos(window)
    while not glfw.window_should_close(window):
        seconds, before = glfw.get_time() - before, glfw.get_time()
        drag, mouse = np.subtract(glfw.get_cursor_pos(window), mouse), glfw.get_cursor_pos(window)
        if glfw.get_mouse_button(window, glfw.MOUSE_BUTTON_LEFT):
            azimuth, climb = azimuth - 0.002 * drag[0], np.clip(climb + 0.002 * drag[1], -1.5, 1.5)
        ahead = np.array([np.cos(climb) * np.sin(azimuth), np.cos(climb) * np.cos(azimuth), np.sin(climb)])
        right = np.array([np.cos(azimuth), -np.sin(azimuth), 0])
        for key, way in (("W", ahead), ("S", -ahead), ("D", right), ("A", -right)):
            eye = eye + 1000 * seconds * way * glfw.get_key(window, getattr(glfw, f"KEY_{key}"))
        tolerance_px *= 1.25 ** (pressed.count(glfw.KEY_MINUS) - pressed.count(glfw.KEY_EQUAL))
        shows_levels = pressed.count(glfw.KEY_SPACE) % 2 == 1
        line = terrain.draw(terrain.ctx.screen, look(eye, ahead, map_.fov_deg, size), tolerance_px, shows_levels)
        glfw.set_window_title(window, line)
        glfw.swap_buffers(window)
        glfw.poll_events()


def main():
    """Read the command line."""
    parser = argparse.ArgumentParser(description="The whole method in one file.")
    parser.add_argument("words", nargs="*", metavar="PICTURE.png MAP")
    parser.add_argument("--max-error", type=float, default=1.0, metavar="PX")
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 720))
    options = parser.parse_args()
    picture = next((word for word in options.words if word.endswith(".png")), None)
    map_ = open_map(next((word for word in options.words if word != picture), "alpine"))
    eye, forward = np.array(map_.eye, float), np.subtract(map_.target, map_.eye)
    if not picture:
        glfw, window = open_window(options.size)
        if window:
            return fly(glfw, window, map_, options.size, eye, forward, options.max_error)
        print("no display for a window: a picture instead")
    view = look(eye, forward, map_.fov_deg, options.size)
    draw_picture(picture or "11_the_method.png", map_, tuple(options.size), view, options.max_error)


if __name__ == "__main__":
    main()
