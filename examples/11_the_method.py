"""Example 11: the whole method in one file
========================================

From a heightmap to a picture whose error in pixels is known before it is drawn. It needs numpy and moderngl alone.

A metre near the eye is many pixels, and a metre far away is none. So land far away needs fewer triangles. How few?
A table answers: four fetches tell whether any cell in a box is off by more than the eye tolerates there.

The real method does more. This file simplifies it:

- The truth is the heights at the posts. Between the posts there is no bound, and no vertex.
- A patch has at least 2 segments a side. There are no pairs, and no closer bounds for fans and stars.
- A unit of a ring has at most 32 segments a side. If a far one needs more, the certified error is above the tolerance.
- Error classes are half an octave wide. One thread sums a whole row of the table.
- A metre is as many pixels everywhere as it is in the picture's worst corner.
- The CPU reads the numbers of patches and divides them into draws.
- Posts have one spacing and no voids, and the Earth is flat. The light is simple.

Run: ``python 11_the_method.py`` for a window, ``python 11_the_method.py PICTURE.png [MAP]`` for a picture
"""

import argparse
import json
import struct
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
    """Open a map of `heightmaps/maps.json` by its name, or metres in a .npy file with a post every 30 m."""
    folder = Path(__file__).resolve().parent.parent / "heightmaps"
    known = json.loads((folder / "maps.json").read_text()).get(name)
    if known:
        heights = np.float32(known["z_offset_m"]) + np.float32(known["z_scale"]) * read_png(folder / known["file"])
        return Map(heights, known["spacing_m"], known["look"], *(known["view"][k] for k in ("eye", "target", "fov")))
    heights = np.load(name).astype(np.float32)
    north, east = (30.0 * (n - 1) for n in heights.shape)
    return Map(heights, 30.0, "alpine", (east / 2, 0, heights.max()), (east / 2, north / 2, heights.mean()), 45.0)


def read_png(path):
    """Read a 16-bit grey PNG, (rows, cols). A byte is stored as its difference from a guess by known neighbours."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        packed += data[at + 8 : at + 8 + length] if kind == b"IDAT" else b""
        at += length + 12
    cols, rows, *form = struct.unpack(">IIBB", data[16:26])
    assert form == [16, 0], f"{path}: expected 16 bits of colour type 0, got {form}"
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(rows, 1 + 2 * cols)
    kinds, diagonals = lines[:, :1].astype(int), rows + cols - 1
    stored = np.zeros((rows, diagonals + 1, 2), np.int16)
    stored[:, :cols] = lines[:, 1:].reshape(rows, cols, 2)
    stored = stored.reshape(-1, 2)[: rows * diagonals].reshape(rows, diagonals, 2)  # row r begins in column r
    known = np.zeros((diagonals + 2, rows + 1, 2), np.int16)
    for k in range(diagonals):  # pixels of a diagonal do not depend on each other
        near = west, north, corner = known[k + 1, 1:], known[k + 1, :-1], known[k, :-1]
        nearest = np.argmin([abs(north - corner), abs(west - corner), abs(west + north - 2 * corner)], axis=0)
        guess = np.choose(kinds, [0 * west, west, north, (west + north) // 2, np.choose(nearest, near)])
        known[k + 2, 1:] = stored[:, k] + guess & 255
    row, col = np.indices((rows, cols))
    return np.float32(known[row + col + 2, row + 1] @ [256, 1])


def write_png(path, pixels):
    """Write (rows, cols, 3) bytes."""
    lines = np.insert(pixels.reshape(len(pixels), -1), 0, 0, axis=1)
    head = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 2, 0, 0, 0)
    chunks = b"IHDR" + head, b"IDAT" + zlib.compress(lines.tobytes()), b"IEND"
    body = b"".join(struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in chunks)
    Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + body)


# -- 2. The error of a cell --------------------------------------------------------------------------------------------
# Level j draws every 2^j-th post. A cell of level j is two triangles. OpenGL does not say which diagonal they share.
# So we take the worse one, at every post of the closed cell. With the twist t = a - b - c + d of its corners, the
# diagonals are  t min(x (1-y), y (1-x))  and  -t min(x y, (1-x) (1-y))  above the bilinear surface.
# A finer neighbour puts new vertices on an edge of the cell. They are up to `above` or `below` the straight edge, and
# move the surface by at most w times that: w is 1 on the edge and 0 on the opposite side.

TABLES = """
struct Cell { float error_m, low_m, high_m; };
layout(std430, binding = 0) buffer Cells { Cell cells[]; };
layout(std430, binding = 1) buffer Sums { uint S[]; };
layout(binding = 0) uniform sampler2D u_heights;
float post(ivec2 at) { return texelFetch(u_heights, min(at, LAST), 0).r; }
ivec2 cells_of(int j) { return (LAST - 1 >> j) + 1; }  // columns and rows
int cell_at(int j, ivec2 at) { return FIRST_CELL[j] + at.y * cells_of(j).x + at.x; }
"""

ERRORS = """
layout(local_size_x = 8, local_size_y = 8) in;
uniform int u_j;
float largest(vec4 v) { return max(max(v.x, v.y), max(v.z, v.w)); }
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID), low = at << u_j, end = min(low + (1 << u_j), LAST), n = end - low;
    if (any(greaterThanEqual(at, cells_of(u_j)))) return;
    float a = post(low), b = post(ivec2(end.x, low.y)), c = post(ivec2(low.x, end.y)), d = post(end), t = a - b - c + d;
    vec4 above = vec4(0.0), below = vec4(0.0);  // edges: north, south, west, east
    for (int i = 1; i < max(n.x, n.y); i++) {
        ivec2 k = min(ivec2(i), n);
        vec4 h = vec4(post(low + ivec2(k.x, 0)), post(low + ivec2(k.x, n.y)), post(low + ivec2(0, k.y)), 0.0);
        h.w = post(low + ivec2(n.x, k.y));
        h -= mix(vec4(a, c, a, b), vec4(b, d, c, d), vec4(k.xxyy) / vec4(n.xxyy));
        above = max(above, h);
        below = max(below, -h);
    }
    Cell cell = Cell(0.0, FAR, -FAR);
    for (ivec2 i = ivec2(0); i.y <= n.y; i = i.x < n.x ? i + ivec2(1, 0) : ivec2(0, i.y + 1)) {
        vec2 p = vec2(i) / vec2(n), q = 1.0 - p;
        vec4 w = vec4(q.y, p.y, q.x, p.x);
        float falling = t * min(p.x * q.y, p.y * q.x), rising = -t * min(p.x * p.y, q.x * q.y), h = post(low + i);
        float off_m = mix(mix(a, b, p.x), mix(c, d, p.x), p.y) - h;
        float over_m = off_m + max(falling, rising) + largest(w * above);
        float under_m = largest(w * below) - off_m - min(falling, rising);
        cell = Cell(max(cell.error_m, max(over_m, under_m)), min(cell.low_m, h), max(cell.high_m, h));
    }
    cell.error_m += 1e-6 * max(abs(cell.low_m), abs(cell.high_m));  // rounding
    cells[cell_at(u_j, at)] = cell;
}
"""

# -- 3. The table: how many cells of a box are above an error class? ---------------------------------------------------
#   S(x, y)   = number of such cells (i, j) with i < x, j < y               (Crow 1984; Porikli 2005)
#   box(a, b) = S(b.x, b.y) - S(a.x, b.y) - S(b.x, a.y) + S(a.x, a.y)       four fetches for any box
# Sums may wrap around: the difference is exact for fewer than 65,536 cells. So a word has the counters of two classes.

COUNTS = """
float limit_m(int c) { return LARGEST_M * exp2(-0.5 * float(c)); }  // of error class c
int sum_at(int j, int word, ivec2 at) {
    ivec2 size = cells_of(j) + 1;
    return FIRST_SUM[j] + (word * size.y + at.y) * size.x + at.x;
}
uint cells_above(ivec2 low, int side_log2, int margin, int j, int c) {
    ivec2 a = max(low - margin, 0) >> j, b = (min(low + (1 << side_log2) + margin, LAST) - 1 >> j) + 1;
    if (any(lessThanEqual(b, a))) return 0u;
    uint east = S[sum_at(j, c / 2, b)] - S[sum_at(j, c / 2, ivec2(b.x, a.y))];
    uint both = east - S[sum_at(j, c / 2, ivec2(a.x, b.y))] + S[sum_at(j, c / 2, a)];
    return c % 2 == 0 ? both & 0xffffu : both >> 16;
}
"""

SUMS = """
layout(local_size_x = 8) in;
uniform int u_j;
uniform ivec2 u_along;  // first along rows, then along columns
void main() {
    int word = int(gl_GlobalInvocationID.y);
    ivec2 at = u_along.yx * int(gl_GlobalInvocationID.x);
    for (uint sum = 0u; all(lessThan(at, cells_of(u_j))); at += u_along) {
        float error_m = cells[cell_at(u_j, at)].error_m;
        uint counts = uint(error_m > limit_m(2 * word)) | uint(error_m > limit_m(2 * word + 1)) << 16;
        int here = sum_at(u_j, word, at + 1);
        sum += u_along.x == 1 ? counts : S[here];
        S[here] = sum;
    }
}
"""

# -- 4. From metres to pixels ------------------------------------------------------------------------------------------
# In the camera's axes a point is (x, y, z), z is its depth, and the vertical is v. A point that rises by d moves by
#   K |d| |(v.x - x/z v.z, v.y - y/z v.z)| / (z + d v.z)   pixels.
# K d / distance is no bound: in a corner it is up to 2.4 times too small. The norm is convex in (x/z, y/z), so it is
# largest in a corner of the picture: u_scale_px is K times that.

VIEW = """
uniform vec3 u_eye, u_sides[4];  // inward normals of the picture's sides
uniform mat3 u_axes;             // from world metres to right, up, depth
uniform vec2 u_tan;              // x/z and y/z at the picture's edges
uniform float u_scale_px, u_tolerance_px;
vec3 world(ivec2 at, float h) { return vec3(at.x * SPACING_M, (LAST.y - at.y) * SPACING_M, h); }
float tilt() { return abs(u_axes[2].z); }
float error_px(float z, float d) { return z > d * tilt() ? u_scale_px * d / (z - d * tilt()) : FAR; }
float error_within_m(float z) { return 0.9999 * u_tolerance_px * z / (u_scale_px + u_tolerance_px * tilt()); }

// Smallest depth of a box, FAR if it is not in the picture. Its heights are those of the cells that it meets.
float depth_of(ivec2 low, int side_log2, int margin) {
    int j = min(side_log2, TOP);
    ivec2 from = max(low - margin, 0), to = min(low + (1 << side_log2) + margin, LAST), a = from >> j, b = to - 1 >> j;
    if (any(lessThan(b, a))) return FAR;  // beyond the map
    vec2 range_m = vec2(FAR, -FAR);
    for (ivec2 i = a; i.y <= b.y; i = i.x < b.x ? i + ivec2(1, 0) : ivec2(a.x, i.y + 1)) {
        Cell cell = cells[cell_at(j, i)];
        range_m = vec2(min(range_m.x, cell.low_m), max(range_m.y, cell.high_m));
    }
    vec3 one = world(from, range_m.x), other = world(to, range_m.y);
    vec3 middle = 0.5 * (one + other) - u_eye, extent = 0.5 * abs(other - one), ahead = transpose(u_axes)[2];
    for (int i = 0; i < 4; i++) if (dot(u_sides[i], middle) + dot(abs(u_sides[i]), extent) < 0.0) return FAR;
    float depth_m = dot(ahead, middle), reach_m = dot(abs(ahead), extent);
    return depth_m + reach_m < NEAR_M ? FAR : max(depth_m - reach_m, NEAR_M);
}
"""

# -- 5. The level of each patch ----------------------------------------------------------------------------------------
# Ring l has 16 × 16 blocks of 8 × 8 units, and a unit has 2 × 2 cells of 2^l posts. The finer ring fills its middle.
# Rings slide with the eye by two units, so their squares need not be nodes of a tree: the table answers for any box.
# A square of 1, 2, 4 or 8 units has the coarsest spacing whose count of cells above the tolerated error is 0. Four
# squares become one where that costs no more. A patch costs its triangles, and 28 more.

LEAVES = """
uniform ivec2 u_origin[RINGS];  // north-west posts; the finest ring is the first
layout(std430, binding = 2) buffer Leaves { int leaves[]; };  // a word for each unit of each ring
struct Leaf { ivec2 low; int side_log2, step_log2, ring; };   // posts
int unit_at(int ring, ivec2 at) { return (ring * UNITS + at.y) * UNITS + at.x; }
Leaf leaf_over(ivec2 post) {  // the leaf that covers the cell south-east of a post
    for (int ring = 0; ring < RINGS; ring++) {
        ivec2 at = post - u_origin[ring] >> ring + 1;
        if (at != (at & UNITS - 1)) continue;
        int word = leaves[unit_at(ring, at)], side_log2 = word >> 8;
        return Leaf((at << ring + 1 >> side_log2 << side_log2) + u_origin[ring], side_log2, word & 255, ring);
    }
    return Leaf(post, 0, 24, RINGS);  // beyond all rings
}
"""

DECIDE = """
layout(local_size_x = 8, local_size_y = 8) in;  // a block
shared float s_cost[64];
shared int s_leaf[64];
bool holds(ivec2 low, int side_log2, int margin, int j) {
    float error_m = error_within_m(depth_of(low, side_log2, margin));
    int c = max(int(ceil(2.0 * log2(LARGEST_M / error_m))), 0);  // limit_m(c) <= error_m
    return j <= 0 || error_m > SPAN_M || c < CLASSES && cells_above(low, side_log2, margin, j, c) == 0u;
}

// A square as one leaf, and its cost. An edge has at most 64 segments.
// - A neighbour asks for more only if a box three times as wide needs more.
// - A unit is always whole, with at most 32 segments a side: an edge of the coarser ring may have two of them.
// - A larger square does not touch the finer ring. So one of two leaves that meet has the whole edge.
int whole_leaf(ivec2 low, int size, int ring, out float cost) {
    int side_log2 = ring + 1 + size, side = 1 << side_log2, finest = max(side_log2 - (size == 0 ? 5 : 6), 0);
    int j = min(findLSB(low.x | low.y | side / 2), TOP);  // the corner is on the lattice
    while (j > finest && !holds(low, side_log2, 0, j)) j--;
    ivec2 finer = u_origin[max(ring - 1, 0)], beyond = finer + (UNITS << ring);
    bool touches = ring > 0 && all(lessThanEqual(finer, low + side)) && all(lessThanEqual(low, beyond));
    bool fits = !touches && holds(low, side_log2, 0, j) && holds(low, side_log2, side, side_log2 - 6);
    cost = size == 0 || fits ? 28.0 + exp2(2.0 * float(side_log2 - j) + 1.0) : FAR;
    return side_log2 << 8 | j;
}

void main() {
    ivec2 unit = ivec2(gl_LocalInvocationID), at = ivec2(gl_GlobalInvocationID);
    int me = unit.y * 8 + unit.x, ring = int(gl_WorkGroupID.z);
    for (int size = 0; size <= 3; size++) {
        barrier();
        if ((unit >> size << size) != unit) continue;
        int half_ = 1 << size >> 1;
        float cost, parts = s_cost[me] + s_cost[me + half_] + s_cost[me + 8 * half_] + s_cost[me + 9 * half_];
        int leaf = whole_leaf(u_origin[ring] + (at << ring + 1), size, ring, cost);
        bool is_whole = size == 0 || cost <= parts;
        s_cost[me] = is_whole ? cost : parts;
        if (is_whole) s_leaf[me] = leaf;
    }
    barrier();
    for (int size = 0; size <= 3; size++) {  // the largest leaf over a unit is the last one
        ivec2 corner = unit >> size << size;
        int leaf = s_leaf[corner.y * 8 + corner.x];
        if (leaf >> 8 == ring + 1 + size) leaves[unit_at(ring, at)] = leaf;
    }
}
"""

# -- 6. Edges without cracks -------------------------------------------------------------------------------------------
# Where two leaves meet, the longer side is the edge. Its spacing is the finest among all leaves along it, on both
# sides. Both sides compute the same number from the same words, so they have the same vertices.

PATCHES = """
struct Patch { ivec2 low; int side_log2, step_log2; ivec4 edges_log2; };  // log2 of segments: west, north, east, south
layout(std430, binding = 3) buffer Patches { uint certified_px, counts[7]; Patch patches[]; };
"""

EMIT = """
layout(local_size_x = 8, local_size_y = 8) in;
ivec2 beside(Leaf leaf, int side, int along) {  // a post of the cells along a side: 0 west, 1 north, 2 east, 3 south
    int across = side < 2 ? -1 : 1 << leaf.side_log2;
    return leaf.low + (side % 2 == 0 ? ivec2(across, along) : ivec2(along, across));
}
int edge_step_log2(Leaf leaf, int side) {
    Leaf other = leaf_over(beside(leaf, side, 0)), longer = leaf;
    if (other.side_log2 > leaf.side_log2) {
        longer = other;
        side ^= 2;  // the edge is the other's opposite side
    }
    int step_log2 = longer.step_log2;
    for (int along = 0; along < 1 << longer.side_log2; along += 1 << other.side_log2) {
        other = leaf_over(beside(longer, side, along));
        step_log2 = min(step_log2, other.step_log2);
    }
    return step_log2;
}
float bound_m(Leaf leaf) {  // the smallest class limit that no cell of a leaf is above
    int c = 0;
    while (c < CLASSES && cells_above(leaf.low, leaf.side_log2, 0, leaf.step_log2, c) == 0u) c++;
    return leaf.step_log2 == 0 ? 0.0 : c == 0 ? SPAN_M : limit_m(c - 1);
}
void main() {
    int ring = int(gl_WorkGroupID.z), most_log2 = 0;
    ivec2 low = u_origin[ring] + (ivec2(gl_GlobalInvocationID) << ring + 1);
    Leaf leaf = leaf_over(low);
    float depth_m = depth_of(low, leaf.side_log2, 0);
    if (leaf.ring != ring || leaf.low != low || depth_m == FAR) return;
    Patch p = Patch(low, leaf.side_log2, leaf.step_log2, ivec4(0));
    for (int side = 0; side < 4; side++) {
        p.edges_log2[side] = leaf.side_log2 - edge_step_log2(leaf, side);
        most_log2 = max(most_log2, p.edges_log2[side]);
    }
    patches[most_log2 * MOST_PATCHES + int(atomicAdd(counts[most_log2], 1u))] = p;
    atomicMax(certified_px, floatBitsToUint(error_px(depth_m, bound_m(leaf))));
}
"""

# -- 7. Tessellation: a patch has T × T cells, and segments of its own on each edge -----------------------------------

VERTEX = "flat out int v_patch; void main() { v_patch = gl_VertexID; }"
PLACE = "in vec4 v_place; out vec4 out_place; void main() { out_place = v_place; }"

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
    v_place = vec4(world(at, post(at)), p.step_log2);
    vec3 q = u_axes * (v_place.xyz - u_eye);
    gl_Position = vec4(q.xy / u_tan, q.z - 2.0 * NEAR_M, q.z);
}
"""

# -- 8. The light: an evening sun with shadows, a blue sky, and the air between ----------------------------------------

SCREEN = "void main() { gl_Position = vec4(ivec2(gl_VertexID % 2, gl_VertexID / 2) * 4 - 1, 0.0, 1.0); }"

SHADE = """
layout(binding = 1) uniform sampler2D u_places;  // 2 × 2 samples a pixel
uniform bool u_shows_levels;
out vec4 out_colour;
float height_m(vec2 post, float lod) { return textureLod(u_heights, (post + 0.5) / vec2(LAST + 1), lod).r; }
vec3 sky(vec3 to) {
    float up = max(to.z, 0.0), toward = max(dot(to, SUN), 0.0);
    vec3 blue = mix(vec3(0.66, 0.56, 0.52), vec3(0.08, 0.19, 0.44), 1.0 - exp(-6.0 * up));
    return blue + vec3(1.0, 0.50, 0.20) * (0.5 * pow(toward, 5.0) * exp(-5.0 * up) + 0.5 * pow(toward, 80.0));
}
float sunlight(vec2 post, float h) {  // how much of the sun stands above the land
    float gap = 1.0, climb = SPACING_M * SUN.z / length(SUN.xy);
    for (float d = 1.0; d < 400.0; d *= 1.2) {
        float land_m = height_m(post + d * normalize(SUN.xy) * vec2(1, -1), log2(d) - 2.0);
        gap = min(gap, 0.5 + (h + d * climb - land_m) / ((0.04 * d + 0.2) * SPACING_M));
    }
    return smoothstep(0.0, 1.0, gap);
}
vec3 colour(vec4 place, vec3 ray) {
    if (place.w < 0.0) return sky(ray);
    vec2 post = vec2(place.x, float(LAST.y) * SPACING_M - place.y) / SPACING_M;
    float away_m = distance(place.xyz, u_eye), d = max(1.0, away_m / u_scale_px / SPACING_M), lod = log2(d);
    float east = height_m(post + vec2(d, 0), lod) - height_m(post - vec2(d, 0), lod);
    float north = height_m(post - vec2(0, d), lod) - height_m(post + vec2(0, d), lod);
    vec3 n = normalize(vec3(-east, -north, 2.0 * d * SPACING_M));
    float height = (place.z - LOWEST_M) / SPAN_M, stands_out = (place.z - height_m(post, 4.0)) / SPACING_M;
    vec3 ground = mix(FLAT, STEEP, smoothstep(0.08, 0.30, 1.0 - n.z + 0.3 * smoothstep(0.3, 0.6, height)));
    ground = mix(ground, HIGH, smoothstep(0.45, 0.60, height - 0.5 * (1.0 - n.z)));
    if (u_shows_levels) ground = 0.3 + 0.3 * cos(1.3 * place.w + vec3(0.0, 2.1, 4.2));
    float sun = max(dot(n, SUN), 0.0) * sunlight(post, place.z);
    vec3 lit = ground * (vec3(4.4, 2.8, 1.5) * sun + vec3(0.30, 0.42, 0.70) * clamp(0.7 + 0.1 * stands_out, 0.3, 1.0));
    float air = 1.0 - exp(-1.6e-5 * away_m * exp(-max(place.z - LOWEST_M, 0.0) / 1500.0));
    return mix(lit, 0.75 * sky(normalize(ray * vec3(1, 1, 0.1))), air);
}
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) * 2, size = textureSize(u_places, 0);
    vec4 places[4];
    for (int i = 0; i < 4; i++) places[i] = texelFetch(u_places, at + ivec2(i & 1, i >> 1), 0);
    vec3 ray = normalize(vec3((2.0 * vec2(at + 1) / vec2(size) - 1.0) * u_tan, 1.0) * u_axes), sum = vec3(0.0);
    float apart_m = max(distance(places[0], places[3]), distance(places[1], places[2]));
    int n = apart_m < 0.03 * distance(places[0].xyz, u_eye) ? 1 : 4;  // only silhouettes need all samples
    for (int i = 0; i < n; i++) sum += colour(places[i], ray) / float(n);
    vec3 film = sum * (2.51 * sum + 0.03) / (sum * (2.43 * sum + 0.59) + 0.14);  // Narkowicz 2015
    out_colour = vec4(pow(clamp(film, 0.0, 1.0), vec3(1.0 / 2.2)), 1.0);
}
"""

# -- 9. The frame ------------------------------------------------------------------------------------------------------
CLASSES = 24
TOP = 7  # level of the coarsest cells
UNITS = 128  # across a ring
MOST_PATCHES = 1 << 16  # of each number of segments
MOST_VERTICES = 60_000  # of a draw: Mesa's software renderer fails from 65,536 on


def look(eye, forward, fov_deg, size):
    """Uniforms of the camera at `eye` that looks along `forward`; `fov_deg` is its vertical field of view."""
    ahead, right = forward / np.linalg.norm(forward), np.cross(forward, (0, 0, 1))
    right = right / np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, ahead), ahead])
    tan = np.tan(np.radians(fov_deg) / 2) * np.array([size[0] / size[1], 1])
    corners = [tan * (i, j) for i in (-1, 1) for j in (-1, 1)]
    scale_px = size[1] / 2 / tan[1] * max(np.linalg.norm(axes[:2, 2] - corner * axes[2, 2]) for corner in corners)
    sides = [tuple(tan[k] * ahead + sign * axes[k]) for k in (0, 1) for sign in (-1, 1)]
    view = {"u_eye": tuple(eye), "u_axes": tuple(axes.T.ravel()), "u_tan": tuple(tan)}
    return view | {"u_scale_px": scale_px, "u_sides": sides}


class Terrain:
    """A map on the GPU, its tables, and its shaders."""

    def __init__(self, ctx, map_, size):
        self.ctx, self.map, (rows, cols) = ctx, map_, map_.heights.shape
        self.sizes = [(-(-(cols - 1) // 2**j), -(-(rows - 1) // 2**j)) for j in range(TOP + 1)]  # cells of each level
        cells = np.cumsum([0, 0] + [x * y for x, y in self.sizes[1:]]).tolist()
        sums = np.cumsum([0, 0] + [(x + 1) * (y + 1) * CLASSES // 2 for x, y in self.sizes[1:]]).tolist()
        self.rings = 2 + max(0, int(np.ceil(np.log2(max(rows, cols) / (UNITS - 4)))))
        flat, steep, high = (f"vec3{colour}" for colour in GROUND[map_.look])
        self.head = f"""#version 430
            const ivec2 LAST = ivec2({cols - 1}, {rows - 1});
            const int TOP = {TOP}, CLASSES = {CLASSES}, UNITS = {UNITS};
            const int RINGS = {self.rings}, MOST_PATCHES = {MOST_PATCHES};
            const int FIRST_CELL[] = int[]{tuple(cells)}, FIRST_SUM[] = int[]{tuple(sums)};
            const float SPACING_M = {map_.spacing_m}, LARGEST_M = 8.0 * SPACING_M, NEAR_M = 5.0, FAR = 1e9;
            const float LOWEST_M = {map_.heights.min()}, SPAN_M = {np.ptp(map_.heights) + 1};
            const vec3 SUN = normalize(vec3(-0.9, -0.2, 0.3)), FLAT = {flat}, STEEP = {steep}, HIGH = {high};
            """
        self.head += TABLES + COUNTS + VIEW + LEAVES + PATCHES
        sizes = 12 * cells[-1], 4 * sums[-1], 4 * UNITS**2 * self.rings, 32 + 32 * 7 * MOST_PATCHES
        self.buffers = [ctx.buffer(reserve=n) for n in sizes]
        for binding, buffer in enumerate(self.buffers):
            buffer.bind_to_storage_buffer(binding)
        self.heights = ctx.texture((cols, rows), 1, map_.heights.tobytes(), dtype="f4")
        self.heights.build_mipmaps()
        self.heights.repeat_x = self.heights.repeat_y = False
        self.heights.use(0)
        self.build_tables()
        self.decide, self.emit = (ctx.compute_shader(self.head + text) for text in (DECIDE, EMIT))
        self.places = ctx.texture((2 * size[0], 2 * size[1]), 4, dtype="f4")
        self.samples = ctx.framebuffer(self.places, ctx.depth_renderbuffer(self.places.size))
        self.land = self.program(VERTEX, PLACE, self.head + CONTROL, self.head + EVALUATION)
        self.shade = self.program(SCREEN, SHADE)

    def program(self, vertex, fragment, *tessellation):
        """Compile the stages of a draw without vertex buffers."""
        program = self.ctx.program(self.head + vertex, self.head + fragment, None, *tessellation)
        return self.ctx.vertex_array(program, [])

    def build_tables(self):
        """Compute the errors of all cells, and sum them along rows and columns."""
        errors, sums = (self.ctx.compute_shader(self.head + text) for text in (ERRORS, SUMS))
        self.buffers[1].clear()
        for j in range(1, TOP + 1):
            errors["u_j"] = sums["u_j"] = j
            errors.run(*(-(-n // 8) for n in self.sizes[j]))
            for along in ((1, 0), (0, 1)):
                self.ctx.memory_barrier()
                sums["u_along"] = along
                sums.run(-(-self.sizes[j][along[0]] // 8), CLASSES // 2)
            self.ctx.memory_barrier()

    def origins(self, eye):
        """North-west posts of the rings around an eye: even places of their lattices."""
        last = np.array(self.map.heights.shape[::-1]) - 1
        post = np.clip([eye[0] / self.map.spacing_m, last[1] - eye[1] / self.map.spacing_m], 0, last)
        step = 4 << np.arange(self.rings)[:, None]  # two units
        return (step * np.round(post / step - UNITS / 4).astype(int)).tolist()

    def select(self, view, tolerance_px):
        """Choose the patches of a view. Returns the certified error in pixels, and the counts by log2 of segments."""
        self.buffers[3].clear(size=32)
        for kernel in (self.decide, self.emit):
            tell(kernel, view | {"u_tolerance_px": tolerance_px, "u_origin": self.origins(view["u_eye"])})
            kernel.run(UNITS // 8, UNITS // 8, self.rings)
            self.ctx.memory_barrier()
        found = self.buffers[3].read(32)
        return float(np.frombuffer(found, np.float32)[0]), np.frombuffer(found, np.int32)[1:].tolist()

    def draw_patches(self, array, counts):
        """Draw patches in portions that emit at most MOST_VERTICES each."""
        self.ctx.patch_vertices = 1
        for log2, count in enumerate(counts):
            most = MOST_VERTICES // (2**log2 + 1) ** 2
            for first in range(0, count, most):
                array.render(moderngl.PATCHES, min(most, count - first), first=log2 * MOST_PATCHES + first)

    def draw(self, target, view, tolerance_px, style=0):
        """Draw a view: shaded, the levels in colours, or their wireframe. Returns a line about it."""
        certified_px, counts = self.select(view, tolerance_px)
        self.samples.use()
        self.samples.clear(alpha=-1.0)
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.wireframe = style == 2
        tell(self.land.program, view)
        with self.ctx.query(primitives=True) as query:
            self.draw_patches(self.land, counts)
        self.ctx.wireframe = False
        self.ctx.enable_only(moderngl.NOTHING)
        target.use()
        self.places.use(1)
        tell(self.shade.program, view | {"u_shows_levels": style > 0})
        self.shade.render(moderngl.TRIANGLES, 3)
        return f"{query.primitives:,} triangles in {sum(counts):,} patches, at most {certified_px:.3f} px off"


def tell(program, values):
    """Set those uniforms that a program has."""
    for name, value in values.items():
        if name in program:
            program[name] = value


# -- 10. A picture, or a window ----------------------------------------------------------------------------------------


def draw_picture(path, map_, size, view, tolerance_px):
    """Draw without a window, and write a PNG."""
    ctx = moderngl.create_context(430, standalone=True, backend="egl", libgl="libGL.so.1", libegl="libEGL.so.1")
    target = ctx.simple_framebuffer(size, 3)
    print(Terrain(ctx, map_, size).draw(target, view, tolerance_px))
    write_png(path, np.frombuffer(target.read(), np.uint8).reshape(size[1], size[0], 3)[::-1])
    print("wrote", path)


def fly(glfw, window, map_, size, eye, forward, tolerance_px):
    """Fly: W A S D and a dragging mouse, + and - change the tolerance, the space bar changes the style."""
    glfw.make_context_current(window)
    terrain, style, pressed = Terrain(moderngl.create_context(430), map_, size), 0, set()
    azimuth, climb = np.arctan2(forward[0], forward[1]), np.arcsin(forward[2] / np.linalg.norm(forward))
    glfw.set_key_callback(window, lambda _w, key, _code, action, _mods: action and pressed.add(key))
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
        tolerance_px *= 1.25 ** ((glfw.KEY_MINUS in pressed) - (glfw.KEY_EQUAL in pressed))
        style = (style + (glfw.KEY_SPACE in pressed)) % 3
        pressed.clear()
        line = terrain.draw(terrain.ctx.screen, look(eye, ahead, map_.fov_deg, size), tolerance_px, style)
        glfw.set_window_title(window, line)
        glfw.swap_buffers(window)
        glfw.poll_events()


def open_window(size):
    """Open a window. Returns the module glfw and the window, which is None without a display."""
    import glfw

    glfw.ERROR_REPORTING = False
    if not glfw.init():
        return glfw, None
    glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 4)
    glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
    glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
    glfw.window_hint(glfw.RESIZABLE, False)
    return glfw, glfw.create_window(*size, "The whole method", None, None)


def main():
    """Read the command line."""
    parser = argparse.ArgumentParser(description="The whole method in one file.")
    parser.add_argument("words", nargs="*", metavar="PICTURE.png MAP")
    parser.add_argument("-o", dest="picture")
    parser.add_argument("--max-error", type=float, default=1.0, metavar="PX")
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 720))
    parser.add_argument("--eye", type=float, nargs=3)
    parser.add_argument("--target", type=float, nargs=3)
    options = parser.parse_args()
    names = [word for word in options.words if not word.endswith(".png")]
    picture = options.picture or next((word for word in options.words if word.endswith(".png")), None)
    map_ = open_map(names[0] if names else "alpine")
    eye = np.array(options.eye or map_.eye, float)
    forward = np.array(options.target or map_.target) - eye
    if not picture:
        glfw, window = open_window(options.size)
        if window:
            return fly(glfw, window, map_, options.size, eye, forward, options.max_error)
        print("no display for a window: a picture instead")
    view = look(eye, forward, map_.fov_deg, options.size)
    draw_picture(picture or "11_the_method.png", map_, tuple(options.size), view, options.max_error)


if __name__ == "__main__":
    main()
