// shade/pixel.glsl — the main of a style: one pixel, that of the fragment, or one of the list of LISTED pixels.
//   Pixels with edges are few and lie scattered. In a list they fill whole groups of threads, and none waits for them.
// The includer gives colour_of_pixel().

#ifdef LISTED

layout(local_size_x = 64) in;
layout(rgba8, binding = 2) writeonly uniform image2D u_picture;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= listed_count) return;
    ivec2 at = ivec2(listed[i] & 0xffffu, listed[i] >> 16);
    g_frag_coord = vec4(vec2(at) + 0.5, 0.0, 1.0);
    imageStore(u_picture, at, colour_of_pixel());
}

#else

out vec4 out_colour;

void main() { out_colour = colour_of_pixel(); }

#endif
