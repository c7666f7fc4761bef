// shade/pixel.glsl — the end of every style: main() for the pixel of a fragment, or (with LISTED) of the list.
//   Pixels with edges are few and scattered. From a list they fill whole groups of threads,
//   so no other pixel waits for them.
// The including file defines ground_colour(); also either sky_colour() and colour_of_pixel(), or the macro SKY_COLOUR.
// It may define SHOWN, a function from the mean colour of the samples to the colour on the screen.
// With CLEAR, alpha is the share of samples that do not see the open sky; with EXACT, colours are multiplied by it.

#ifdef SKY_COLOUR
#ifndef SHOWN
#define SHOWN
#endif
vec3 sky_colour(Ray ray) { return SKY_COLOUR; }

vec4 colour_of_pixel() { return vec4(SHOWN(pixel_colour()), 1.0); }
#endif

vec4 picture_colour() {
    vec4 colour = colour_of_pixel();
    if (CLEAR == 0) return colour;
    float share = 1.0 - float(g_open) / float(SAMPLES);
#ifdef EXACT
    return share * colour;
#else
    return vec4(g_open == SAMPLES ? vec3(0.0) : colour.rgb, share * colour.a);
#endif
}

#ifdef LISTED
layout(local_size_x = 64) in;
layout(rgba8, binding = 2) writeonly uniform image2D u_picture;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= listed_count) return;
    ivec2 at = ivec2(listed[i] & 0xffffu, listed[i] >> 16);
    g_frag_coord = vec4(vec2(at) + 0.5, 0.0, 1.0);
    find_hidden();
    imageStore(u_picture, at, picture_colour());
}
#else
out vec4 out_colour;

void main() {
    find_hidden();
    out_colour = picture_colour();
}
#endif
