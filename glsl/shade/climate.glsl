// shade/climate.glsl — zones of vegetation and snow by height.
//   They follow from the latitude, not from the lowest and highest height of the map.
//   So a part of a map looks the same as in the whole map, and an edit elsewhere changes nothing.
//   A climate is three numbers at each corner of the map, bilinear in between:
//   the tree line in metres, the snow line in metres, and dryness, 0 to 1.
// Provides Climate, climate_at(), zone_of().   Python twin: light.climate

struct Climate {
    float trees_m, snow_m, dryness;
};

uniform vec3 u_climate[4];  // north-west, north-east, south-west, south-east
uniform float u_base_m;     // the height that the map's heights are relative to

Climate climate_at(vec2 post) {
    vec2 t = clamp(post / vec2(u_last_post), 0.0, 1.0);
    vec3 c = mix(mix(u_climate[0], u_climate[1], t.x), mix(u_climate[2], u_climate[3], t.x), t.y);
    return Climate(c.x, c.y, c.z);
}

#define TREES_END 0.33  // zones are numbers from 0, at the sea; trees end at this zone,
#define SNOW_STAYS 0.60 // and snow begins at this zone

float zone_of(float up_m, Climate c) {
    if (up_m < c.trees_m) return TREES_END * up_m / max(c.trees_m, 100.0);
    return TREES_END + (SNOW_STAYS - TREES_END) * (up_m - c.trees_m) / max(c.snow_m - c.trees_m, 100.0);
}
