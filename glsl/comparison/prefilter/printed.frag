// comparison/prefilter/printed.frag — the supplement's own shading, or a step towards it (light/printed.glsl).

#include "shade/samples.glsl"
#include "light/printed.glsl"
#include "light/shown.glsl"

vec3 ground_colour(Ground g, int sample_) { return land_colour(g, outgoing_light(g, lit_as_printed(g)), g.distance_m); }

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
