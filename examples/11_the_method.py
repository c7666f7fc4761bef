"""Example 11: the whole method in one file
========================================

Near the eye a metre is many pixels, far away less than one pixel. So distant land needs fewer triangles. How few? Four
fetches from tables tell whether any cell in a box has an error above the tolerance at this distance. Simplifications:

- The truth is the heights at the posts. Between the posts there is no bound, and no vertex.
- A patch has 2 to 32 segments a side. If a patch needs more, the certified error is above the tolerance.
- Every box is as high as the whole map. Each metre of error counts as in the worst corner of the picture.
- The CPU reads the number of patches and divides them into draws. The Earth is flat, and the light has no shadows.

Run: ``python 11_the_method.py`` for a window, ``python 11_the_method.py PICTURE.png [MAP]`` for a picture
"""

import argparse
import json
import struct
import sys
import zlib
from collections import namedtuple
from pathlib import Path

import moderngl
import numpy as np

# -- 1. The map: heights in metres at posts, row 0 is the northern edge; and a first view of it ------------------------
Map = namedtuple("Map", "heights spacing_m eye target fov_deg")


def open_map(name):
    """Open a map of `heightmaps/maps.json`. Its file is a PNG with 16 bits of grey."""
    folder = Path(globals().get("__file__", sys.argv[0])).resolve().parent.parent / "heightmaps"  # or from a gallery
    known = json.loads((folder / "maps.json").read_text())[name]
    data, at, packed = (folder / known["file"]).read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        packed += data[at + 8 : at + 8 + length] if kind == b"IDAT" else b""
        at += length + 12
    cols, rows = struct.unpack(">II", data[16:24])
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(rows, 1 + 2 * cols)
    stored, pixels = lines[:, 1:].reshape(rows, cols, 2), np.zeros((rows + 1, cols + 1, 2), np.int16)
    for k in range(rows + cols - 1):  # bytes are differences from a guess; pixels of a diagonal can be guessed at once
        row = np.arange(max(0, k - cols + 1), min(rows, k + 1))
        west, north, corner = pixels[row + 1, k - row], pixels[row, k - row + 1], pixels[row, k - row]
        nearest = np.argmin([abs(north - corner), abs(west - corner), abs(west + north - 2 * corner)], axis=0)
        guesses = 0 * west, west, north, (west + north) // 2, np.choose(nearest, [west, north, corner])
        pixels[row + 1, k - row + 1] = stored[row, k - row] + np.choose(lines[row, :1], guesses) & 255
    heights = np.float32(known["z_offset_m"]) + np.float32(known["z_scale"]) * np.float32(pixels[1:, 1:] @ [256, 1])
    return Map(heights, known["spacing_m"], *(known["view"][key] for key in ("eye", "target", "fov")))


# -- 2. The tables: how many cells of a box have an error above the limit of a class? ----------------------------------
# Level j draws every 2^j-th post, and has a table for each class:                        (Crow 1984; Porikli 2005)
#   S(x, y)   = number of cells (i, j) with i < x, j < y and an error above the limit of the class
#   box(a, b) = S(b.x, b.y) - S(a.x, b.y) - S(b.x, a.y) + S(a.x, a.y)                     four fetches for any box
TABLES = """
layout(std430, binding = 0) buffer Sums { uint S[]; };
layout(binding = 0) uniform sampler2D u_heights;
float post(int col, int row) { return texelFetch(u_heights, min(ivec2(col, row), LAST), 0).r; }
ivec2 cells_of(int j) { return (LAST - 1 >> j) + 1; }  // columns and rows
float limit_m(int c) { return 2.0 * SPAN_M * exp2(-0.5 * float(c)); }  // of class c; no error is above limit_m(0)
int at(int j, int c, int x, int y) { return FIRST[j] + (c * (cells_of(j).y + 1) + y) * (cells_of(j).x + 1) + x; }
uint cells_above(ivec2 low, int side, int j, int c) {
    ivec2 a = clamp(low, ivec2(0), LAST) >> j, b = (clamp(low + side, ivec2(0), LAST) - 1 >> j) + 1;
    return S[at(j, c, b.x, b.y)] - S[at(j, c, a.x, b.y)] - S[at(j, c, b.x, a.y)] + S[at(j, c, a.x, a.y)];
}
"""
# A cell of level j is two triangles, with an unknown diagonal. Let t = a - b - c + d be the twist of the corners. With
# one diagonal, the triangles are t min(x (1-y), y (1-x)) above the bilinear surface, with the other diagonal they are
# t min(x y, (1-x) (1-y)) below: take the worse. If a finer patch cuts an edge, no point moves by more than `cut_m`.
ERRORS = """
layout(local_size_x = 8, local_size_y = 8) in;
void main() {
    int j = int(gl_GlobalInvocationID.z) + 1;
    ivec2 cell = ivec2(gl_GlobalInvocationID), low = cell << j, end = min(low + (1 << j), LAST);
    if (any(greaterThanEqual(cell, cells_of(j)))) return;
    float a = post(low.x, low.y), b = post(end.x, low.y), c = post(low.x, end.y), d = post(end.x, end.y);
    float t = a - b - c + d, off_m = 0.0, cut_m = 0.0;
    for (int y = low.y; y <= end.y; y++) for (int x = low.x; x <= end.x; x++) {
        vec2 p = vec2(ivec2(x, y) - low) / vec2(end - low), q = 1.0 - p;
        float e = mix(mix(a, b, p.x), mix(c, d, p.x), p.y) - post(x, y);  // of the bilinear surface
        off_m = max(off_m, max(abs(e + t * min(p.x * q.y, p.y * q.x)), abs(e - t * min(p.x * p.y, q.x * q.y))));
        if (p.x * q.x * p.y * q.y == 0.0) cut_m = max(cut_m, abs(e));
    }
    float error_m = off_m + cut_m + 1e-6 * max(abs(LOWEST_M), abs(LOWEST_M + SPAN_M));  // and rounding
    for (int c = 0; c < CLASSES; c++) S[at(j, c, cell.x + 1, cell.y + 1)] = uint(error_m > limit_m(c));
}
"""
SUMS = """
layout(local_size_x = 8) in;
uniform ivec2 u_along;  // first along rows, then along columns
void main() {
    ivec3 id = ivec3(gl_GlobalInvocationID);
    ivec2 i = u_along.yx * id.x + 1;
    for (uint sum = 0u; all(lessThanEqual(i, cells_of(id.z + 1))); i += u_along)
        S[at(id.z + 1, id.y, i.x, i.y)] = sum += S[at(id.z + 1, id.y, i.x, i.y)];
}
"""
# -- 3. From metres to pixels ------------------------------------------------------------------------------------------
# In the camera's axes a point is (x, y, z), z is its depth, and the vertical is v. A point that rises by d moves by
#   K |d| |(v.x - x/z v.z, v.y - y/z v.z)| / (z + d v.z) <= scale_px |d| / (z - |d v.z|)   pixels.
# The norm is largest in a corner of the picture; scale_px is K times it there. So a limit in pixels limits |d| / z.
VIEW = """
// u_axes: from world metres to right, up, depth; u_tan: x/z and y/z at the picture's edges; u_most: tolerated |d| / z
layout(std430, binding = 3) buffer View { vec3 u_eye; mat3 u_axes; vec2 u_tan; float u_scale_px, u_most; };
vec3 world(ivec2 at, float h) { return vec3(at.x * SPACING_M, (LAST.y - at.y) * SPACING_M, h); }
float depth_of(ivec2 low, int side) {  // the smallest depth of a box, FAR if it is not in the picture
    ivec2 from = max(low, 0), to = min(low + side, LAST);
    vec3 one = world(from, LOWEST_M), other = world(to, LOWEST_M + SPAN_M), q = u_axes * (0.5 * (one + other) - u_eye);
    vec3 reach = mat3(abs(u_axes[0]), abs(u_axes[1]), abs(u_axes[2])) * abs(other - one) * 0.5;
    bool beside = any(greaterThan(abs(q.xy) - reach.xy, u_tan * (q.z + reach.z))) || any(lessThanEqual(to, from));
    return beside || q.z + reach.z < NEAR_M ? FAR : max(q.z - reach.z, NEAR_M);
}
"""
# -- 4. The level of each patch ----------------------------------------------------------------------------------------
# Ring l has 32 × 32 blocks of 4 × 4 units, and a unit has 2 × 2 cells of 2^l posts. The finer ring fills its middle.
# Rings follow the eye in steps of two units. Their squares are not nodes of a tree, but the tables answer for any box.
# Each square gets the coarsest spacing at which all cells are within the tolerance. A block is one patch if that pays.
RINGS = """
struct Patch { ivec2 low; int side_log2, step_log2; };  // posts
layout(std430, binding = 1) buffer Rings { Patch units[]; };  // the patch over each unit of each ring
layout(std430, binding = 2) buffer Found { uint certified, count; Patch patches[]; };
ivec2 origin(int ring) {  // the north-west post: a multiple of two units
    vec2 eye = clamp(vec2(u_eye.x, float(LAST.y) * SPACING_M - u_eye.y) / SPACING_M, vec2(0.0), vec2(LAST));
    return ivec2(round(eye / float(4 << ring))) - UNITS / 4 << ring + 2;
}
"""
DECIDE = """
layout(local_size_x = 4, local_size_y = 4) in;
bool holds(ivec2 low, int side, int j) {
    int c = max(int(ceil(2.0 * log2(2.0 * SPAN_M / u_most / depth_of(low, side)))), 0);  // limit_m(c) <= u_most z
    return j <= 0 || c < CLASSES && cells_above(low, side, j, c) == 0u;
}
Patch over(ivec2 low, int side_log2) {
    int j = min(side_log2 - 1, TOP);
    while (j > max(side_log2 - 5, 0) && !holds(low, 1 << side_log2, j)) j--;
    return Patch(low, side_log2, j);
}
float cost(Patch p) { return 8.0 + exp2(2.0 * float(p.side_log2 - p.step_log2) + 1.0); }  // its triangles, and 8
void main() {
    int ring = int(gl_GlobalInvocationID.z), side = 8 << ring;
    ivec2 at = 4 * ivec2(gl_GlobalInvocationID), low = origin(ring) + (at << ring + 1);
    ivec2 finer = ring > 0 ? origin(ring - 1) : ivec2(-1 << 24), end = finer + (UNITS << ring);
    Patch block = over(low, ring + 3), parts[16];
    float parts_cost = 0.0;
    for (int i = 0; i < 16; i++) {
        parts[i] = over(low + (ivec2(i % 4, i / 4) << ring + 1), ring + 1);
        parts_cost += cost(parts[i]);
    }
    // A block beside the finer ring is not one patch, so a common edge is always a whole side of one of two patches. An
    // edge has at most 64 segments: no patch in a box three times as wide may need more.
    bool alone = any(lessThan(low + side, finer)) || any(lessThan(end, low)), pays = cost(block) <= parts_cost;
    bool is_block = alone && pays && holds(low, side, block.step_log2) && holds(low - side, 3 * side, ring - 3);
    for (int i = 0; i < 16; i++) {
        Patch p = is_block ? block : parts[i];
        units[(ring * UNITS + at.y + i / 4) * UNITS + at.x + i % 4] = p;
        float z = depth_of(p.low, 1 << p.side_log2);
        bool is_other = all(greaterThanEqual(p.low, finer)) && all(lessThan(p.low, end)) || is_block && i > 0;
        if (is_other || z == FAR) continue;  // the finer ring or the block draws it; or it is not in the picture
        patches[atomicAdd(count, 1u)] = p;
        int c = CLASSES - 1;
        while (cells_above(p.low, 1 << p.side_log2, p.step_log2, c) > 0u) c--;
        if (p.step_log2 > 0) atomicMax(certified, floatBitsToUint(limit_m(c) / z));
    }
}
"""
# -- 5. Edges without cracks, and tessellation -------------------------------------------------------------------------
# Where two patches meet, a common edge is a whole side of the larger patch. Its spacing is the finest among all patches
# along it. Both sides compute the same number, so they have the same vertices. Inside, a patch has T × T cells.
VERTEX = "void main() { gl_Position = vec4(gl_VertexID); }"  # the number of a patch
CONTROL = """
layout(vertices = 1) out;
Patch beside(Patch p, int side, int along) {  // the neighbour at a post of a side: 0 west, 1 north, 2 east, 3 south
    int across = side < 2 ? -1 : 1 << p.side_log2;
    ivec2 post = p.low + (side % 2 == 0 ? ivec2(across, along) : ivec2(along, across));
    for (int ring = 0; ring < RINGS; ring++) {
        ivec2 at = post - origin(ring) >> ring + 1;
        if (at == (at & UNITS - 1)) return units[(ring * UNITS + at.y) * UNITS + at.x];
    }
    return Patch(post, 0, 24);  // beyond all rings
}
int edge_log2(Patch p, int side) {  // log2 of its segments
    Patch other = beside(p, side, 0);
    bool is_shorter = other.side_log2 > p.side_log2;  // then the edge is the other's opposite side
    Patch longer = is_shorter ? other : p;
    int step_log2 = longer.step_log2;
    for (int along = 0; along < 1 << longer.side_log2; along += 1 << other.side_log2) {
        other = beside(longer, is_shorter ? side ^ 2 : side, along);
        step_log2 = min(step_log2, other.step_log2);
    }
    return p.side_log2 - step_log2;
}
void main() {
    Patch p = patches[int(gl_in[0].gl_Position.x)];
    gl_out[gl_InvocationID].gl_Position = gl_in[0].gl_Position;
    for (int side = 0; side < 4; side++) gl_TessLevelOuter[side] = float(1 << edge_log2(p, side));
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = float(1 << p.side_log2 - p.step_log2);
}
"""
EVALUATION = """
layout(quads, equal_spacing, cw) in;
out vec3 v_place;
void main() {
    Patch p = patches[int(gl_in[0].gl_Position.x)];
    ivec2 at = min(p.low + ivec2(round(gl_TessCoord.xy * float(1 << p.side_log2))), LAST);  // a post
    v_place = world(at, post(at.x, at.y));
    vec3 q = u_axes * (v_place - u_eye);
    gl_Position = vec4(q.xy / u_tan, q.z - 2.0 * NEAR_M, q.z);
}
"""
# -- 6. The light: an evening sun, a blue sky, and the air between -----------------------------------------------------
HAZE, BLUE = np.array([0.79, 0.74, 0.73]), np.array([0.32, 0.46, 0.68])
SHADE = """
in vec3 v_place;
out vec4 out_colour;
float height_m(vec2 post, float lod) { return textureLod(u_heights, (post + 0.5) / vec2(LAST + 1), lod).r; }
void main() {
    vec2 post = vec2(v_place.x, float(LAST.y) * SPACING_M - v_place.y) / SPACING_M;
    float away_m = distance(v_place, u_eye), d = max(1.0, away_m / u_scale_px / SPACING_M), lod = log2(d);
    vec2 rise = vec2(height_m(post + vec2(d, 0), lod), height_m(post - vec2(0, d), lod));
    rise -= vec2(height_m(post - vec2(d, 0), lod), height_m(post + vec2(0, d), lod));
    vec3 n = normalize(vec3(-rise, 2.0 * d * SPACING_M));
    float steep = 1.0 - n.z, light = clamp(0.7 + 0.1 * (v_place.z - height_m(post, 4.0)) / SPACING_M, 0.3, 1.0);
    vec3 ground = mix(vec3(0.06, 0.09, 0.03), vec3(0.16, 0.13, 0.11), smoothstep(0.08, 0.3, steep + v_place.z / 2e4));
    ground = mix(ground, vec3(0.70, 0.75, 0.84), smoothstep(1700.0, 2300.0, v_place.z - 1500.0 * steep));
    vec3 lit = light * ground * (vec3(0.3, 0.42, 0.7) + vec3(4.4, 2.8, 1.5) * max(dot(n, vec3(-0.9, -0.2, 0.3)), 0.0));
    out_colour = vec4(mix(HAZE, pow(1.0 - exp(-1.5 * lit), vec3(1.0 / 2.2)), exp(-1.6e-5 * away_m)), 1.0);
}
"""
# -- 7. The frame ------------------------------------------------------------------------------------------------------
CLASSES, TOP, UNITS = 32, 7, 128  # error classes; level of the coarsest cells; units across a ring
PATCHES_PER_DRAW = 15  # of 65 × 65 vertices: Mesa's software renderer fails if a draw has 65,536 vertices or more


def look(eye, forward, fov_deg, size):
    """The block View for a camera at `eye` that looks along `forward`; `fov_deg` is its vertical field of view."""
    view, right = np.zeros((5, 4), np.float32), np.cross(forward, (0, 0, 1))
    axes = np.stack([right, np.cross(right, forward), forward])
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    tan = np.tan(np.radians(fov_deg) / 2) * np.array([size[0] / size[1], 1])
    scale_px = size[1] / 2 / tan[1] * np.linalg.norm(abs(axes[:2, 2]) + tan * abs(axes[2, 2]))
    view[0, :3], view[1:4, :3], view[4, :3] = eye, axes.T, (*tan, scale_px)
    return view


class Terrain:
    """A map on the GPU, its tables, and its shaders."""

    def __init__(self, ctx, map_):
        self.ctx, self.map, (rows, cols) = ctx, map_, map_.heights.shape
        counters = [CLASSES * ((cols - 2 >> j) + 2) * ((rows - 2 >> j) + 2) for j in range(1, TOP + 1)]  # of each level
        first = np.cumsum([0, 0, *counters]).tolist()
        self.rings = rings = 2 + max(0, int(np.ceil(np.log2(max(rows, cols) / (UNITS - 4)))))
        self.head = f"""#version 430
            const ivec2 LAST = ivec2({cols - 1}, {rows - 1});
            const int TOP = {TOP}, CLASSES = {CLASSES}, UNITS = {UNITS}, RINGS = {rings}, FIRST[] = int[]{tuple(first)};
            const float SPACING_M = {map_.spacing_m}, NEAR_M = 5.0, FAR = 1e9;
            const float LOWEST_M = {map_.heights.min()}, SPAN_M = {np.ptp(map_.heights) + 1};
            const vec3 HAZE = vec3{tuple(HAZE.tolist())};
            {TABLES}{VIEW}{RINGS}"""
        self.buffers = [ctx.buffer(bytes(16 * n)) for n in (first[-1] // 4, UNITS**2 * rings, UNITS**2 * rings + 1, 5)]
        for binding, buffer in enumerate(self.buffers):
            buffer.bind_to_storage_buffer(binding)
        self.heights = ctx.texture((cols, rows), 1, map_.heights.tobytes(), dtype="f4")
        self.heights.build_mipmaps()
        self.heights.use()
        errors, sums, self.decide = (ctx.compute_shader(self.head + text) for text in (ERRORS, SUMS, DECIDE))
        vertex, shade, *tessellation = (self.head + text for text in (VERTEX, SHADE, CONTROL, EVALUATION))
        self.land = ctx.vertex_array(ctx.program(vertex, shade, None, *tessellation), [])
        errors.run(-(-cols // 16), -(-rows // 16), TOP)
        for along in ((1, 0), (0, 1)):
            ctx.memory_barrier()
            sums["u_along"] = along
            sums.run(-(-max(rows, cols) // 16), CLASSES, TOP)
        ctx.memory_barrier()

    def select(self, view, tolerance_px):
        """Choose the patches of a view. Returns their certified error in pixels, and their number."""
        scale_px, tilt = float(view[4, 2]), float(abs(view[3, 2]))
        view[4, 3] = 0.9999 * tolerance_px / (scale_px + tolerance_px * tilt)
        self.buffers[3].write(view)
        self.buffers[2].clear(size=8)
        self.decide.run(UNITS // 16, UNITS // 16, self.rings)
        self.ctx.memory_barrier()
        certified, count = struct.unpack("fI", self.buffers[2].read(8))
        return scale_px * certified / max(1 - certified * tilt, 1e-9), count

    def draw(self, target, view, tolerance_px, wires=False):
        """Draw a view, or its wires. Returns a line about it."""
        certified_px, count = self.select(view, tolerance_px)
        target.use()
        for row in range(target.height):  # the sky
            target.clear(*(HAZE + (BLUE - HAZE) * row / target.height), viewport=(0, row, target.width, 1))
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.depth_func, self.ctx.wireframe = "<", wires
        self.ctx.patch_vertices = 1
        with self.ctx.query(primitives=True) as query:
            for first in range(0, count, PATCHES_PER_DRAW):
                self.land.render(moderngl.PATCHES, min(PATCHES_PER_DRAW, count - first), first=first)
        return f"{query.primitives:,} triangles in {count:,} patches, at most {certified_px:.3f} px off"


# -- 8. A window, or a picture -----------------------------------------------------------------------------------------
def fly(map_, size, tolerance_px):
    """Fly with W, S and a dragging mouse. + and - change the tolerance, the space bar shows the wires."""
    import glfw

    glfw.ERROR_REPORTING = False
    if not glfw.init():
        return print("no display for a window: a picture instead")
    glfw.window_hint(glfw.SAMPLES, 4)
    window = glfw.create_window(*size, "The whole method", None, None)
    glfw.make_context_current(window)
    terrain, before, mouse = Terrain(moderngl.create_context(430), map_), glfw.get_time(), (0, 0)
    eye, ahead = np.array(map_.eye), np.subtract(map_.target, map_.eye)
    while not glfw.window_should_close(window):
        glfw.poll_events()
        seconds, before = glfw.get_time() - before, glfw.get_time()
        drag, mouse = np.subtract(glfw.get_cursor_pos(window), mouse), glfw.get_cursor_pos(window)
        w, s, minus, plus, space = (glfw.get_key(window, key) for key in map(ord, "WS-= "))
        view = look(eye, ahead, map_.fov_deg, size)
        right, up, forward = view[1:4, :3].T
        ahead = forward + 0.002 * glfw.get_mouse_button(window, 0) * (drag[1] * up - drag[0] * right)
        eye = eye + 1000 * seconds * (w - s) * forward
        tolerance_px *= 4 ** (seconds * (minus - plus))
        glfw.set_window_title(window, terrain.draw(terrain.ctx.screen, view, tolerance_px, space == 1))
        glfw.swap_buffers(window)
    return True


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="The whole method in one file.")
    parser.add_argument("picture", nargs="?", help="a PNG to write; without it a window opens")
    parser.add_argument("map", nargs="?", default="alpine-30m")
    parser.add_argument("--max-error", type=float, default=1.0, metavar="PX")
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 720))
    options = parser.parse_args()
    map_, size, picture = open_map(options.map), options.size, options.picture
    if picture or not fly(map_, size, options.max_error):
        ctx = moderngl.create_context(430, standalone=True, backend="egl", libgl="libGL.so.1", libegl="libEGL.so.1")
        samples, target = ctx.simple_framebuffer(size, 3, samples=4), ctx.simple_framebuffer(size, 3)
        view = look(map_.eye, np.subtract(map_.target, map_.eye), map_.fov_deg, size)
        print(Terrain(ctx, map_).draw(samples, view, options.max_error))
        ctx.copy_framebuffer(target, samples)
        pixels = np.frombuffer(target.read(), np.uint8).reshape(size[1], -1)[::-1]
        packed = zlib.compress(np.insert(pixels, 0, 0, axis=1).tobytes())
        chunks = b"IHDR" + struct.pack(">IIBBBBB", *size, 8, 2, 0, 0, 0), b"IDAT" + packed, b"IEND"
        body = b"".join(struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in chunks)
        Path(picture or "11_the_method.png").write_bytes(b"\x89PNG\r\n\x1a\n" + body)
        print("wrote", picture or "11_the_method.png")
