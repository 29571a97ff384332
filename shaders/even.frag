// One color.
uniform vec4 color;  // sRGB, alpha
out vec4 seen;

void main() { seen = color; }
