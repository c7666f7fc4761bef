// shade/samples.glsl — the second pass of a picture: from the places that a pixel's samples see to one colour.
//   Samples on the same ground are shaded once, around their centre; their number is the weight. The sky fills the
//   rest. Most pixels have no edge: their programs (shade/kind.glsl) shade one piece of ground, or the sky.
// The including file defines ground_colour() and sky_colour(), in display-linear light.
// With CLEAR, samples of the open sky do not count: the colour is the mean of the others.
// Provides pixel_colour(), g_open, Ground.

#include "shade/contours.glsl"

#ifndef CLEAR
#define CLEAR 0
#endif

int g_open = 0;  // with CLEAR, the number of samples that see the open sky

vec3 ground_colour(Ground g, int sample_);
vec3 sky_colour(Ray ray);

// Ground that samples see, given as bits, with its contour lines.
vec3 drawn_colour(Ground g, int samples) { return contoured(ground_colour(g, findLSB(samples)), g, samples); }

// The samples, as bits, that see ground inside the footprint of this place.
int samples_near(Ground g) {
    int near = 0;
    for (int i = 0; i < SAMPLES; i++) {
        vec2 post = post_of_sample(i);
        if (!is_sky(post) && all(lessThanEqual(abs(post - g.post), 2.0 * g.extent))) near |= 1 << i;
    }
    return near;
}

vec2 middle_of(int samples) {
    vec2 sum = vec2(0.0);
    for (int i = 0; i < SAMPLES; i++)
        if ((samples >> i & 1) != 0) sum += post_of_sample(i);
    return sum / float(bitCount(samples));
}

// The offset from the pixel's centre to the centre of these samples.
vec2 offset_of(int samples) {
    vec2 offset = vec2(0.0);
    for (int i = 0; i < SAMPLES; i++) offset += float(samples >> i & 1) * offset_of_sample(i);
    return offset / float(bitCount(samples));
}

// The ground that a group of samples sees; its footprint is around their centre.
Ground ground_of(int samples) {
    Ground g = ground_under(footprint_at(middle_of(samples)), middle_of(samples), view_ray(offset_of(samples)));
    g.samples = samples;
    return g;
}

#define ALL ((1 << SAMPLES) - 1)

// The samples, as bits, that see a given part of the surroundings: a number of surroundings_at().
int samples_around(int seen) {
    int alike = 0;
    for (int i = 0; i < SAMPLES; i++) alike |= int(surroundings_at(ray_at(offset_of_sample(i))) == seen) << i;
    return alike;
}

// The colour of the sky and of the map's surroundings, with edges between them. At least one of `samples` is set.
vec3 around_colour(int samples) {
    if (CLEAR == 1 && EDGE == 0) g_open = bitCount(samples);
    if (EDGE == 0) return CLEAR == 1 ? vec3(0.0) : float(bitCount(samples)) * sky_colour(view_ray(vec2(0.0)));
    vec3 sum = vec3(0.0);
    do {
        vec2 first = offset_of_sample(findLSB(samples));
        int seen = surroundings_at(ray_at(first)), alike = samples & samples_around(seen);
        vec2 centre = offset_of(alike);
        samples &= ~alike;
        vec2 at = surroundings_at(ray_at(centre)) == seen ? centre : first;
        if (CLEAR == 1 && seen == 0) g_open += bitCount(alike);
        else sum += float(bitCount(alike)) * sky_colour(view_ray(at));
    } while (samples != 0);
    return sum;
}

float ground_share() {
    int count = 0;
    for (int i = 0; i < SAMPLES; i++) count += is_sky(post_of_sample(i)) ? 0 : 1;
    return float(count) / float(SAMPLES);
}

vec3 mean_of_samples(vec3 sum) { return sum / (CLEAR == 1 ? max(float(SAMPLES - g_open), 1.0) : float(SAMPLES)); }

#if CLEAR == 1 && PIXELS == OPEN
vec3 pixel_colour() {
    g_open = SAMPLES;
    return vec3(0.0);
}
#elif PIXELS == SKY || PIXELS == OPEN
vec3 pixel_colour() {
    bool is_one = CLEAR == 0 && (EDGE == 0 || PIXELS == OPEN);
    return is_one ? sky_colour(view_ray(vec2(0.0))) : mean_of_samples(around_colour(ALL));
}
#elif PIXELS == NEAR
vec3 pixel_colour() { return drawn_colour(ground_of(ALL), ALL); }
#else
vec3 pixel_colour() {
    int left = 0;
    for (int i = 0; i < SAMPLES; i++) left |= is_sky(post_of_sample(i)) ? 0 : 1 << i;
    vec3 sum = left == ALL ? vec3(0.0) : around_colour(ALL ^ left);
    if (left == 0) return mean_of_samples(sum);
    do {  // with the test at the start, software renderers would run one more pass
        int sample_ = findLSB(left);
        int alike = left & (samples_near(footprint_at(post_of_sample(sample_))) | 1 << sample_);
        left &= ~alike;
        sum += float(bitCount(alike)) * drawn_colour(ground_of(alike), alike);
    } while (left != 0);
    return mean_of_samples(sum);
}
#endif
