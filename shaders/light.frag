// Flat light: sRGB as it is sent, blended over black by alpha.
in vec4 vertex_color;
out vec4 light;

void main() { light = vertex_color; }
