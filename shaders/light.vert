// Vertices of light in the projector's optical frame, through its lens onto its image.
layout(location = 0) in vec3 p_optical;  // meters, z > 0
layout(location = 1) in float depth;     // -1 .. 1, linear on the image
layout(location = 2) in vec4 color;      // sRGB, alpha
layout(location = 3) in float size_px;   // points only

uniform vec4 viewport;  // x, y, width, height; px, larger than the image so that points reach in

flat out vec2 center_window;
flat out float point_size;
out vec4 vertex_color;

void main() {
  center_window = windowFromPixel(lensPixel(p_optical));
  point_size = size_px;
  vertex_color = color;
  vec2 ndc = 2.0 * (center_window - viewport.xy) / viewport.zw - 1.0;
  gl_Position = vec4(ndc, depth, 1.0) * p_optical.z;
  gl_PointSize = ceil(size_px) + 2.0;  // room for every pixel the square touches
}
