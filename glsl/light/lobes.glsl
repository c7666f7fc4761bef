// light/lobes.glsl — the ground's lobes: how one place reflects light, and the values that the tables sum.
//   A texel is a block of 2 × 2 cells. Its values are means over the block, signed,
//   in steps of 2^-15, in words that wrap:
//     0–2  Y·n   normals weighted by the luminance of the albedo, for diffuse light          n of horizon/cell.glsl
//     3–5  r     lobes of half-vectors, |r|(κ)·n by their roughness                        (equations C.1, C.3)
//     6–8  a     albedo: red, green, blue
// Provides Merged, merged_at().   Python twin: reference.lobe_values

#include "light/brdf.glsl"
#include "shade/cover.glsl"
#include "blocks/colour.glsl"

#define LOBE_LAYERS 9
#define LOBE_STEPS 32767.0

struct Merged {
    vec3 normal;  // mean vector of the normals: shorter than 1 if they differ
    vec3 r;       // mean vector of the half-vectors
    vec3 albedo;
};

// The lobes of one place, for footprints smaller than a cell.
Merged merged_at(vec3 normal, Material material) {
    return Merged(normal, mean_length(sharpness_of_roughness(material.roughness)) * normal, material.albedo);
}
