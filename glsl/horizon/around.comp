// horizon/around.comp — the height of the horizon towards a light,
//   at the posts of a page of a store and a few posts around it. As in horizon/sweep.comp, one thread marches along one
//   line. But a line begins far outside the page, in the coarsest window (terrain_gl/pages/windows.py), and goes on in
//   finer ones:
//
//      light ←   ·       ·       ·   ·   ·   · · · · · · · · p p p p p
//                window 2        window 1    window 0        the page
//
//   So the horizon of a post comes from the posts of its window, or from coarser land beyond it.
// Python twin: reference.windowed_sines

#include "horizon/hull.glsl"

uniform int u_windows;              // number of windows; in u_heights they lie one below the other
uniform ivec2 u_shift[MAX_WINDOWS];   // `shift` of pages.windows.PageWindows
uniform ivec4 u_within[MAX_WINDOWS];
uniform ivec2 u_core;               // horizons are stored for columns, and for rows, from u_core.x to u_core.y

// The step at which a line crosses a column of a window; columns are counted from the light's side.
int step_at(int window, int column) {
    bool back = is_backward(u_towards);
    int side = u_last_post.x;
    int along = ((back ? side - column : column) << window) + on_axes(u_towards, u_shift[window]).x;
    return back ? side - along : along;
}

// Height where a line crosses a column, between two posts; −1e30 outside the map.
float line_height_m(int line, int window, int column, int step_) {
    int side = u_last_post.x, along = is_backward(u_towards) ? side - column : column;
    float across = (float(line) + slide(u_towards) * float(step_) - float(on_axes(u_towards, u_shift[window]).y))
        / float(1 << window);
    int nearest = int(floor(across + 0.5)), place = int(floor(across));
    ivec2 low = on_axes(u_towards, u_within[window].xy), high = on_axes(u_towards, u_within[window].zw);
    if (nearest < low.y || nearest > high.y || along < low.x || along > high.x) return -1e30;
    ivec2 here = on_axes(u_towards, ivec2(along, max(place, low.y)));
    ivec2 next = on_axes(u_towards, ivec2(along, min(place + 1, high.y)));
    int first_row = window * (side + 1);
    return mix(height_m(here + ivec2(0, first_row)), height_m(next + ivec2(0, first_row)), across - float(place));
}

void main() {
    int own = int(gl_GlobalInvocationID.x), line = u_first_line + own, points = 0, side = u_last_post.x;
    if (own >= u_lines) return;
    int first = is_backward(u_towards) ? side - u_core.y : u_core.x;
    int end = is_backward(u_towards) ? side - u_core.x : u_core.y;
    for (int window = u_windows - 1; window >= 0; window--) {
        int until = window > 0 ? step_at(window - 1, 0) - 1 : end;
        for (int column = 0; column <= side; column++) {
            int at = step_at(window, column);
            if (at > until) break;
            float h_m = line_height_m(line, window, column, at);
            if (h_m < -1e29) continue;
            vec4 record = horizon_record(own, points, Point(h_m, float(at)));
            int place = line + base(u_towards, at);
            if (window > 0 || at < first || place < u_core.x || place > u_core.y) continue;
            imageStore(u_horizon, ivec3(post_at(u_towards, at, place), u_layer), record);
        }
    }
}
