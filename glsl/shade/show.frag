// shade/show.frag — copy the finished picture to a window.

layout(binding = 2) uniform sampler2D u_picture;

uniform vec4 u_window;  // viewport of the window: x, y, width, height

out vec4 out_colour;

void main() { out_colour = vec4(texture(u_picture, (gl_FragCoord.xy - u_window.xy) / u_window.zw).rgb, 1.0); }
