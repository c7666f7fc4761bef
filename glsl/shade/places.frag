// shade/places.frag — the place of the map that a sample of each pixel sees: column and row, negative for the sky.

#include "shade/seen.glsl"

uniform int u_sample;

out vec2 out_post;

void main() { out_post = post_of_sample(u_sample); }
