// shade/samples.glsl — the second pass of a picture: from the places that a pixel's samples see to one colour.
//   Samples on the same piece of ground are shaded once, with their number as weight; the sky fills the rest.
// The includer gives ground_colour() and sky_colour(), in display-linear light.
// Provides pixel_colour(), Ground.

#include "shade/footprint.glsl"

#ifndef SAMPLES
#define SAMPLES 4
#endif
#if SAMPLES > 1
#define POSTS sampler2DMS
#else
#define POSTS sampler2D
#endif

layout(binding = 2) uniform POSTS u_posts;

vec2 post_of_sample(int i) { return texelFetch(u_posts, ivec2(gl_FragCoord.xy), i).xy; }

bool is_sky(vec2 post) { return post.x < 0.0; }

vec3 ground_colour(Ground g, int sample_);
vec3 sky_colour(vec3 direction);

vec3 pixel_colour() {
    vec3 sum = vec3(0.0);
    int left = (1 << SAMPLES) - 1;
    for (int i = 0; i < SAMPLES; i++) {
        if ((left >> i & 1) == 0) continue;
        vec2 post = post_of_sample(i);
        Ground g = ground_at(post);
        int same = 0;
        for (int j = i; j < SAMPLES; j++) {
            vec2 other = post_of_sample(j);
            bool joins = is_sky(post) ? is_sky(other) : !is_sky(other) && all(lessThanEqual(abs(other - post), 2.0 * g.extent));
            if (joins) same |= 1 << j;
        }
        same &= left;
        left &= ~same;
        sum += float(bitCount(same)) * (is_sky(post) ? sky_colour(view_ray()) : ground_colour(g, i));
    }
    return sum / float(SAMPLES);
}
