// shade/steps.glsl — the unit of the summed heights: the map's span has 65,535 steps.
//   The rounding error of a mean over a box is at most half a step, and much less if the terrain crosses many steps.

#include "blocks/terrain.glsl"

float step_m() { return u_span_m / 65535.0; }

float m_from_steps(float steps) { return u_low_m + steps * step_m(); }
