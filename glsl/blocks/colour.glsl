// blocks/colour.glsl — luminance of linear sRGB colours (IEC 61966-2-1).   Python twin: light.atmosphere.LUMINANCE

const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);
