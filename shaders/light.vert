// Vertices of light in the projector's optical frame, through its lens onto its image.
layout(location = 0) in vec3 p_optical;  // meters, z > 0
layout(location = 1) in float depth;     // -1 .. 1, linear on the image
layout(location = 2) in vec4 color;      // sRGB, alpha

uniform vec4 viewport;  // x, y, width, height; px, larger than the image

out vec4 vertex_color;

void main() {
  vertex_color = color;
  vec2 window = windowFromPixel(lensPixel(p_optical));
  vec2 ndc = 2.0 * (window - viewport.xy) / viewport.zw - 1.0;
  gl_Position = vec4(ndc, depth, 1.0) * p_optical.z;
}
