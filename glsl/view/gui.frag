// view/gui.frag — colours of the panels: the vertex's colour times the texture's. The texture has glyphs and a white
//   texel.

in vec2 v_texel;
in vec4 v_color;

layout(binding = 0) uniform sampler2D u_texture;

out vec4 out_color;

void main() { out_color = v_color * texture(u_texture, v_texel); }
