// A picture painted elsewhere, pixel by pixel.
uniform sampler2D painted;  // sRGB, multiplied by alpha
out vec4 light;

void main() { light = texelFetch(painted, ivec2(gl_FragCoord.xy), 0); }
