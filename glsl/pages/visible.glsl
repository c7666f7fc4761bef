// pages/visible.glsl — horizon/visible.glsl for a map of which only some pages are on the GPU.
//   There are no sums. A footprint takes its light from the level whose spacing is as wide as the footprint.
//   If the page there has no light, the finest page above it with light is taken. Between two levels, both are read
//   and blended, so there is no edge where the level changes.
// Provides HAS_SUMS, sky_visible_near(), sun_share().   Python twins: reference.disc_share, reference.pack_shares

const bool HAS_SUMS = false;
float sky_visible(int lobe, vec2 post, vec2 extent) { return 0.0; }  // these two are never called
float sun_over(vec2 post, vec2 extent, vec2 lean) { return 0.0; }

layout(r16, binding = 0) readonly uniform image2D u_sun_horizon;
layout(rgba32ui, binding = 1) readonly uniform uimage2D u_packed;  // texels of all pages, each page with a border

#ifndef SKY_SIDE
#define SKY_SIDE 5    // texels a side of a page, with the border
#define SKY_BORDER 1
#endif

// The finest page with light over a place, from a level up.
struct LitPage {
    ivec2 slot;  // column and row in the pool
    vec2 at;     // the place, in posts of the page
    int level;
};

LitPage lit_page(vec2 post, int level) {
    for (; level < u_top_level; level++)
        if (lit_slot_of(level, min(ivec2(post) >> PAGE_LOG2 + level, pages_of(level) - 1)) >= 0) break;
    ivec2 page = min(ivec2(post) >> PAGE_LOG2 + level, pages_of(level) - 1);
    int slot = max(lit_slot_of(level, page), 0);
    vec2 at = (post - vec2(page << PAGE_LOG2 + level)) / float(1 << level);
    return LitPage(ivec2(slot % SLOTS_ACROSS, slot / SLOTS_ACROSS), min(at, float(PAGE)), level);
}

// The level at which a footprint is one post wide, not rounded.
float level_of(vec2 extent) { return clamp(log2(max(extent.x, extent.y)), 0.0, float(u_top_level)); }

float record_at(LitPage p, ivec2 at) { return imageLoad(u_sun_horizon, p.slot * (PAGE + 1) + at).x; }

float share_in(LitPage p) {
    ivec2 at = min(ivec2(p.at), PAGE - 1);
    vec2 t = p.at - vec2(at);
    float north = mix(record_at(p, at), record_at(p, at + ivec2(1, 0)), t.x);
    float south = mix(record_at(p, at + ivec2(0, 1)), record_at(p, at + 1), t.x);
    return disc_share(sine_of(mix(north, south, t.y)));
}

float sun_share(vec2 post, vec2 extent) {
    float level = level_of(extent);
    LitPage fine = lit_page(post, int(level));
    float share = share_in(fine), t = level - float(fine.level);
    return t <= 0.0 || fine.level == u_top_level ? share : mix(share, share_in(lit_page(post, fine.level + 1)), t);
}

mat4x3 texel_of(LitPage p, ivec2 at) {
    uvec4 words = imageLoad(u_packed, p.slot * SKY_SIDE + at);
    return mat4x3(unpacked(words.x), unpacked(words.y), unpacked(words.z), unpacked(words.w));
}

mat4x3 sky_in(LitPage p) {
    vec2 at = p.at / float(TEXEL) + float(SKY_BORDER) - 0.5, t = fract(at);
    ivec2 first = ivec2(at);
    mat4x3 north = texel_of(p, first) * (1.0 - t.x) + texel_of(p, first + ivec2(1, 0)) * t.x;
    mat4x3 south = texel_of(p, first + ivec2(0, 1)) * (1.0 - t.x) + texel_of(p, first + 1) * t.x;
    return north * (1.0 - t.y) + south * t.y;
}

// A texel is several posts wide. So finer levels are taken than for the sun.
mat4x3 sky_visible_near(vec2 post, vec2 extent) {
    float level = level_of(extent / float(TEXEL));
    LitPage fine = lit_page(post, int(level));
    mat4x3 visible = sky_in(fine);
    float t = level - float(fine.level);
    return t <= 0.0 || fine.level == u_top_level ? visible
        : visible * (1.0 - t) + sky_in(lit_page(post, fine.level + 1)) * t;
}
