// shade/enlarge.frag — copy a smaller picture to a window, enlarged by cubic convolution: Keys 1981, "Cubic convolution
// interpolation for digital image processing", equation 15, in x and in y. A fetch between texels takes two or four of
// them at once, so five fetches take twelve of the sixteen texels. The corners, which weigh least, are left out.

layout(binding = 2) uniform sampler2D u_picture;

uniform vec4 u_window;  // viewport of the window: x, y, width, height

out vec4 out_colour;

void main() {
    vec2 size = vec2(textureSize(u_picture, 0)), at = (gl_FragCoord.xy - u_window.xy) / u_window.zw * size;
    vec2 texel = floor(at - 0.5) + 0.5, t = at - texel;
    vec2 before = t * (-0.5 + t * (1.0 - 0.5 * t));
    vec2 after = t * t * (0.5 * t - 0.5);
    vec2 second = t * (0.5 + t * (2.0 - 1.5 * t));
    vec2 middle = 1.0 - before - after;
    vec2 low = texel - 1.0, between = texel + second / middle, high = texel + 2.0;
    vec3 places[5] = vec3[5](
        vec3(between, middle.x * middle.y), vec3(low.x, between.y, before.x * middle.y),
        vec3(high.x, between.y, after.x * middle.y),
        vec3(between.x, low.y, middle.x * before.y), vec3(between.x, high.y, middle.x * after.y));
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 5; i++)
        sum += places[i].z * vec4(textureLod(u_picture, clamp(places[i].xy, vec2(0.5), size - 0.5) / size, 0.0).rgb,
            1.0);
    out_colour = vec4(clamp(sum.rgb / sum.w, 0.0, 1.0), 1.0);
}
