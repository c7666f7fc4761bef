// horizon/lines.glsl — the map as parallel lines that run away from a light, one thread for each line.
//   In each step a line moves one column away from the light and `slide` posts sideways.
//   If the light is nearer to north or south, rows take the place of columns. `towards` is the opposite step:
//   columns and rows towards the light, the larger of them ±1.
//
//        light       step  0   1   2   3   4     At step i, line b crosses the column at b + slide·i,
//          ↖         ·───·───·───·───·           between two posts: the height there is interpolated.
//            ·       b \   ·   ·   ·   ·
//                    ·    \·   ·   ·   ·         Exactly one line passes each post within half a post,
//                    ·   ·   \ ·   ·   ·         so every post has a record. In a column all lines have
//                    ·   ·   ·  \  ·   ·         the same offset, slack(i), from their posts: records
//                                              are evenly spaced, and bilinear lookups are easy.
//
// Provides first_inside(), last_inside(), on_axes(), step_of(), post_at(), slide(), base(), slack(),
// record_near(), sine_of().
// Python twin: reference.horizon_sines

#include "blocks/terrain.glsl"

#ifdef WINDOW
uniform ivec4 u_inside;  // first and last post of the map in the window
ivec2 first_inside() { return u_inside.xy; }
ivec2 last_inside() { return u_inside.zw; }
#else
ivec2 first_inside() { return ivec2(0); }
ivec2 last_inside() { return u_last_post; }
#endif

bool by_column(vec2 towards) { return abs(towards.x) >= abs(towards.y); }

// (column, row) to (along the light's axis, across), and back.
vec2 on_axes(vec2 towards, vec2 post) { return by_column(towards) ? post : post.yx; }
ivec2 on_axes(vec2 towards, ivec2 post) { return by_column(towards) ? post : post.yx; }

float slide(vec2 towards) { return -on_axes(towards, towards).y; }

bool is_backward(vec2 towards) { return on_axes(towards, towards).x > 0.0; }  // step 0 is the last column or row

int base(vec2 towards, int step_) { return int(floor(slide(towards) * float(step_) + 0.5)); }

float slack(vec2 towards, int step_) { return slide(towards) * float(step_) - float(base(towards, step_)); }

float step_m(vec2 towards) { return length(towards * u_spacing_m); }

ivec2 post_at(vec2 towards, int step_, int place) {
    int along = is_backward(towards) ? on_axes(towards, u_last_post).x - step_ : step_;
    return on_axes(towards, ivec2(along, place));
}

// GLSL cannot pass images to functions. So the including file defines these functions for its own image:
//   record_of(layer, …)      the record of one post
//   record_across(layer, …)  in one column, between two lines: linear interpolation
//   record_near(layer, …)    at any place: bilinear interpolation
#define RECORDS_IN(records)                                                                                            \
    float record_of(int layer, vec2 towards, int step_, int place) {                                                   \
        int low = on_axes(towards, first_inside()).y;                                                                  \
        int high = on_axes(towards, last_inside()).y;                                                                  \
        ivec2 post = post_at(towards, step_, clamp(place, low, high));                                                 \
        return imageLoad(records, ivec3(post, layer)).x;                                                               \
    }                                                                                                                  \
    float record_across(int layer, vec2 towards, int step_, float across) {                                            \
        float y = across - slack(towards, step_);                                                                      \
        int place = int(floor(y));                                                                                     \
        return mix(record_of(layer, towards, step_, place), record_of(layer, towards, step_, place + 1), y - floor(y));\
    }                                                                                                                  \
    float record_near(int layer, vec2 towards, vec2 post) {                                                            \
        vec2 at = on_axes(towards, post);                                                                              \
        int last = on_axes(towards, u_last_post).x;                                                                    \
        float steps = is_backward(towards) ? float(last) - at.x : at.x;                                                \
        int before = clamp(int(floor(steps)), 0, last - 1);                                                            \
        float t = clamp(steps - float(before), 0.0, 1.0);                                                              \
        return mix(record_across(layer, towards, before, at.y), record_across(layer, towards, before + 1, at.y), t);   \
    }

float sine_of(float record) { return 2.0 * record - 1.0; }
