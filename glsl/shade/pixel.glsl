// shade/pixel.glsl — main() of a style, for the pixel of a fragment, or (with LISTED) for a pixel of the list.
//   Pixels with edges are few and scattered. From a list they fill whole groups of threads,
//   so no other pixel waits for them.
// The including file defines colour_of_pixel().

#ifdef LISTED

layout(local_size_x = 64) in;
layout(rgba8, binding = 2) writeonly uniform image2D u_picture;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= listed_count) return;
    ivec2 at = ivec2(listed[i] & 0xffffu, listed[i] >> 16);
    g_frag_coord = vec4(vec2(at) + 0.5, 0.0, 1.0);
    find_hidden();
    imageStore(u_picture, at, colour_of_pixel());
}

#else

out vec4 out_colour;

void main() {
    find_hidden();
    out_colour = colour_of_pixel();
}

#endif
