// shade/steps.glsl — the unit of the heights that are summed: 65,535 steps from the lowest to the highest.
//   A mean over a box is at most half a step off, and far less where the terrain crosses many steps.

#include "blocks/terrain.glsl"

float step_m() { return u_span_m / 65535.0; }

float steps_from_m(float h_m) { return (h_m - u_low_m) / step_m(); }

float m_from_steps(float steps) { return u_low_m + steps * step_m(); }
