// light/lobes.glsl — the ground's lobes: what one place is to light, and what the tables sum of it.
//   A texel is a block of 2 × 2 cells. Summed are means over it, in 2^-15, signed, in words that wrap:
//     0–2  Y·n   normals weighted by luminance of the albedo: what diffuse light sees        n of horizon/cell.glsl
//     3–5  r     lobes of half-vectors, |r|(κ)·n by their roughness                        (equations C.1, C.3)
//     6–8  a     albedo: red, green, blue
// Provides Merged, merged_at(), lobe_blocks().   Python twin: reference.lobe_values

#include "light/brdf.glsl"
#include "shade/cover.glsl"
#include "blocks/colour.glsl"

#define LOBE_LAYERS 9
#define LOBE_STEPS 32767.0

struct Merged {
    vec3 normal;  // mean vector of the normals, as long as they agree
    vec3 r;       // of the half-vectors
    vec3 albedo;
};

// A place alone, where the footprint is smaller than cells.
Merged merged_at(vec3 normal, Material material) {
    return Merged(normal, mean_length(sharpness_of_roughness(material.roughness)) * normal, material.albedo);
}

ivec2 lobe_blocks() { return (u_last_post + 1) / 2; }
