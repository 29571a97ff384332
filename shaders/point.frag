// A square of point_size pixels around its center: each pixel gets the share that it covers, so
// that the centroid is exact at every size and position.
flat in vec2 center_window;
flat in float point_size;
in vec4 vertex_color;
out vec4 light;

void main() {
  vec2 offset = center_window - gl_FragCoord.xy;
  vec2 low = max(offset - 0.5 * point_size, -0.5);
  vec2 high = min(offset + 0.5 * point_size, 0.5);
  vec2 covered = max(high - low, 0.0);
  light = vec4(vertex_color.rgb, vertex_color.a * covered.x * covered.y);
}
