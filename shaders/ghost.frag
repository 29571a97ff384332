// What is gone: gray, and a little shaded, so that it looks solid.
in vec3 normal_world;

uniform vec4 color;  // sRGB, alpha
out vec4 seen;

void main() { seen = vec4(color.rgb * (0.75 + 0.25 * normalize(normal_world).z), color.a); }
