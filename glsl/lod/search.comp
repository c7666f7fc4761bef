// lod/search.comp — the next price λ to try, from how many triangles the last one made. One thread; nothing waits for it but
// the GPU: when λ is found, the dispatches that would try another one find that they have no groups.
//   Triangles fall with λ about as λ^-0.6, whatever the terrain: on paper with logarithms on both axes, a straight line.
//   False position between a λ too cheap and one that keeps to the budget; an end that stays twice counts as half as far
//   from the budget, so that it does not stay for ever (the Illinois method: Dowell, Jarratt 1971).
//
//     log N │ ╲ cheap
//           │  ╲╲                       tried next: where the chord meets
//    budget ├───╳╲──────                the budget, or just below it
//           │    ╲ ╲__ dear
//           └─────────────── log λ
// Python twin: reference.price_for

#include "lod/dispatch.glsl"

layout(local_size_x = 1) in;

uniform bool u_start, u_last;

#define ENOUGH 0.99       // of the budget: look no further
#define AIM 0.995         // of the budget
#define SLOPE 1.7         // octaves of λ for one of triangles, to start with
#define LARGEST_STEP 20.0 // octaves
#define LEAST_STEP 0.01
#define PATIENCE 4u       // rounds of chords; then every other one halves: where eyes stand amid spikes, N(λ) falls in cliffs
#define FREE -60.0        // log2 of a λ that is as good as 0: everything that gains anything is drawn

void set_price(float log_price) { s_price = log_price <= FREE ? 0.0 : exp2(min(log_price, 126.0)); }

void start() {
    s_rounds = 0u;
    s_side = 0;
    s_cheap = s_dear = vec2(UNKNOWN, 0.0);
    set_price(clamp(29.0 - SLOPE * log2(float(s_budget)), -20.0, 40.0));
    dispatch(true);
}

float next(float aim) {
    float octaves = SLOPE * exp2(float(s_rounds - 1u));  // farther with every step in one direction
    if (s_dear.x == UNKNOWN) return s_cheap.x + clamp(octaves * (s_cheap.y - aim), 0.5, LARGEST_STEP);
    if (s_cheap.x == UNKNOWN) return s_dear.x - clamp(octaves * (aim - s_dear.y), 0.5, LARGEST_STEP);
    if (s_rounds > PATIENCE && s_rounds % 2u == 0u) return 0.5 * (s_cheap.x + s_dear.x);
    return mix(s_cheap.x, s_dear.x, clamp((s_cheap.y - aim) / (s_cheap.y - s_dear.y), 0.02, 0.98));
}

void note(vec2 tried, bool fits, float aim) {
    bool again = s_side == (fits ? 1 : -1);
    s_side = fits ? 1 : -1;
    if (fits) s_dear = tried;
    else s_cheap = tried;
    if (again && fits) s_cheap.y = mix(s_cheap.y, aim, 0.5);
    if (again && !fits) s_dear.y = mix(s_dear.y, aim, 0.5);
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
    bool no_better = s_cheap.x != UNKNOWN && s_dear.x != UNKNOWN && s_dear.x - s_cheap.x < LEAST_STEP;
    if (fits && (float(s_triangles) >= ENOUGH * float(s_budget) || s_price == 0.0 || no_better)) dispatch(false);
    else if (u_last || no_better) set_price(s_dear.x == UNKNOWN ? 126.0 : s_dear.x);
    else set_price(next(aim));
}
