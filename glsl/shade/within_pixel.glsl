// shade/within_pixel.glsl — from the middle of a pixel to its samples, where all GPUs have them.
// Provides SAMPLES, SAMPLE_AT.

#ifndef SAMPLES
#define SAMPLES 4
#endif

const vec2 SAMPLE_AT[4] = vec2[4](vec2(-0.125, -0.375), vec2(0.375, -0.125), vec2(-0.375, 0.125), vec2(0.125, 0.375));
