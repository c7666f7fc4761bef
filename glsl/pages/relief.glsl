// pages/relief.glsl — the relief of a map of which only some pages are on the GPU, from the lattices of their levels.
//   We take the finest level whose pages are loaded over the footprint.
//   Near a page that is not loaded, this level fades into the next coarser one:
//     relief = w₀ R₀ + (1 − w₀) (w₁ R₁ + (1 − w₁) (…))
//     w_l = distance to the nearest page that is not loaded, / FADE, 0 to 1
//   So there are no steps where the level changes. If all pages are loaded, w₀ = 1:
//   the relief is that of the map in memory.
// Provides relief_of(), rough_relief().   Python twin: reference.relief

#define FADE 4.0  // in posts of the level

float posts_of_step(int level) { return float(1 << level); }

// A place in steps of a level's lattice. Its last step may be shorter than the others.
vec2 in_lattice(int level, vec2 post) {
    vec2 whole = vec2(last_of(level) - 1), low = whole * posts_of_step(level);
    vec2 rest = clamp((post - low) / (vec2(u_last_post) - low), 0.0, 1.0);
    return level == 0 ? post : min(post / posts_of_step(level), whole) + rest;
}

// Width of a step in posts: a mean over the box around a place.
vec2 step_around(int level, vec2 post, vec2 extent) {
    vec2 reach = max(0.5 * extent, posts_of_step(level));
    vec2 a = max(post - reach, 0.0);
    vec2 b = min(post + reach, vec2(u_last_post));
    return level == 0 ? vec2(1.0) : (b - a) / (in_lattice(level, b) - in_lattice(level, a));
}

// w_l: the share of a level in the relief of a box; places and extents are in steps of that level.
float share_of(int level, vec2 at, vec2 extent) {
    // Half the side of the box of posts that are read.
    vec2 reach = 0.5 * max(min(extent, largest_box_posts()), 2.0) + 1.5, last = vec2(last_of(level));
    ivec2 low = page_at(level, ivec2(clamp(at - reach - FADE, vec2(0.0), last)));
    ivec2 high = page_at(level, ivec2(clamp(at + reach + FADE, vec2(0.0), last)));
    float share = 1.0;
    for (int y = low.y; y <= high.y; y++)
        for (int x = low.x; x <= high.x; x++) {
            if (slot_of(level, ivec2(x, y)) >= 0) continue;
            vec2 first = vec2(ivec2(x, y) << PAGE_LOG2), away = max(first - at, at - first - float(PAGE)) - reach;
            share = min(share, max(max(away.x, away.y), 0.0) / FADE);
        }
    return level >= u_top_level ? 1.0 : share;
}

Relief relief_of_levels(bool is_rough, vec2 post, vec2 extent) {
    Relief sum = Relief(0.0, vec2(0.0));
    float left = 1.0;
    int level = int(finest_over(min(ivec2(post) >> PAGE_LOG2, pages_of(0) - 1)) >> 24);
    do {
        vec2 step_ = step_around(level, post, extent), at = in_lattice(level, post);
        float share = left * share_of(level, at, extent / step_);
        Relief r = is_rough ? rough_relief_on(level, at, extent / step_) : relief_on(level, at, extent / step_);
        sum.height_m += share * r.height_m;
        sum.slope += share * r.slope / step_;
        left -= share;
        level++;
    } while (left > 0.0);
    return sum;
}

Relief relief_of(vec2 post, vec2 extent) { return relief_of_levels(false, post, extent); }

Relief rough_relief(vec2 post, vec2 extent) { return relief_of_levels(true, post, extent); }
