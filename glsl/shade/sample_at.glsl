// shade/sample_at.glsl — offsets from the centre of a pixel to its four samples: the same on all GPUs.

const vec2 SAMPLE_AT[4] = vec2[4](vec2(-0.125, -0.375), vec2(0.375, -0.125), vec2(-0.375, 0.125), vec2(0.125, 0.375));
