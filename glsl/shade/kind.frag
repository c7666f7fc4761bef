// shade/kind.frag — the kind of each pixel, written as depth. A depth test then lets a program run for one kind only.
//   Pixels of kind MIXED are listed.

#include "shade/seen.glsl"
#include "shade/footprint.glsl"

bool is_open() {
    bool open_ = EDGE > 0 && g_hidden == 0;
    for (int i = 0; i < SAMPLES; i++) open_ = open_ && plain_depth(ray_at(offset_of_sample(i))) < 0.0;
    return open_;
}

int kind_of_pixel() {
    vec2 middle = vec2(0.0);
    int land = 0;
    for (int i = 0; i < SAMPLES; i++) {
        vec2 post = post_of_sample(i);
        if (is_sky(post)) continue;
        middle += post / float(SAMPLES);
        land++;
    }
    if (land < SAMPLES) return land > 0 ? MIXED : is_open() ? OPEN : SKY;
    Ground g = footprint_at(middle);
    bool is_one = true;
    for (int i = 0; i < SAMPLES; i++)
        is_one = is_one && all(lessThanEqual(abs(post_of_sample(i) - middle), 2.0 * g.extent));
    return is_one && is_near(g.extent) ? NEAR : MIXED;
}

void main() {
    find_hidden();
    int kind = kind_of_pixel();
    gl_FragDepth = float(kind) / 8.0;
    if (kind != MIXED) return;
    uint i = atomicAdd(listed_count, 1u);
    listed[i] = uint(gl_FragCoord.x) | uint(gl_FragCoord.y) << 16;
    atomicMax(listed_groups[0], i / 64u + 1u);
}
