// lod/quadtree/search.comp — the next price λ to try, from the number of triangles of the last one. One thread.
//   When λ is found, the remaining dispatches get no groups. So the CPU dispatches all rounds without waiting.
//   The number of triangles N falls about like λ^-0.6 on any terrain: nearly a straight line with logarithmic axes. The
//   search is false position between a lower bracket, a λ with too many triangles, and an upper bracket, a λ within the
//   budget. If one end stays the same twice, its distance from the budget is halved,
//   so that it moves later (the Illinois method: Dowell, Jarratt 1971).
//
//     log N │ ╲ lower bracket
//           │  ╲╲                       tried next: where the chord meets
//    budget ├───╳╲──────                the budget, or just below it
//           │    ╲ ╲__ upper bracket
//           └─────────────── log λ
// Python twin: reference.price_for

#include "lod/quadtree/dispatch.glsl"

layout(local_size_x = 1) in;

uniform bool u_start, u_last;

#define ENOUGH 0.99       // this share of the budget ends the search
#define AIM 0.995         // the share of the budget that the search aims at
#define SLOPE 1.7         // at first: octaves of λ for one octave of triangles
#define LARGEST_STEP 20.0 // octaves
#define LEAST_STEP 0.01
#define PATIENCE 4u       // rounds of chords; then every other round bisects: on very rough land N(λ) has jumps
#define FREE -60.0        // log2 of a λ that counts as 0: everything with any gain is drawn

void set_price(float log_price) { s_price = log_price <= FREE ? 0.0 : exp2(min(log_price, 126.0)); }

void start() {
    s_rounds = 0u;
    s_side = 0;
    s_lower = s_upper = vec2(UNKNOWN, 0.0);
    set_price(clamp(29.0 - SLOPE * log2(float(s_budget)), -20.0, 40.0));
    dispatch(true);
}

float next(float aim) {
    float octaves = SLOPE * exp2(float(s_rounds - 1u));  // steps grow while they go in one direction
    if (s_upper.x == UNKNOWN) return s_lower.x + clamp(octaves * (s_lower.y - aim), 0.5, LARGEST_STEP);
    if (s_lower.x == UNKNOWN) return s_upper.x - clamp(octaves * (aim - s_upper.y), 0.5, LARGEST_STEP);
    if (s_rounds > PATIENCE && s_rounds % 2u == 0u) return 0.5 * (s_lower.x + s_upper.x);
    return mix(s_lower.x, s_upper.x, clamp((s_lower.y - aim) / (s_lower.y - s_upper.y), 0.02, 0.98));
}

void note(vec2 tried, bool fits, float aim) {
    bool again = s_side == (fits ? 1 : -1);
    s_side = fits ? 1 : -1;
    if (fits) s_upper = tried;
    else s_lower = tried;
    if (again && fits) s_lower.y = mix(s_lower.y, aim, 0.5);
    if (again && !fits) s_upper.y = mix(s_upper.y, aim, 0.5);
}

void main() {
    if (u_start) {
        start();
        return;
    }
    if (is_over()) return;
    s_rounds++;
    vec2 tried = vec2(s_price == 0.0 ? FREE : log2(s_price), log2(max(float(s_triangles), 1.0)));
    float aim = log2(AIM * float(s_budget));
    bool fits = s_triangles <= s_budget;
    note(tried, fits, aim);
    bool no_better = s_lower.x != UNKNOWN && s_upper.x != UNKNOWN && s_upper.x - s_lower.x < LEAST_STEP;
    if (fits && (float(s_triangles) >= ENOUGH * float(s_budget) || s_price == 0.0 || no_better)) dispatch(false);
    else if (u_last || no_better) set_price(s_upper.x == UNKNOWN ? 126.0 : s_upper.x);
    else set_price(next(aim));
}
