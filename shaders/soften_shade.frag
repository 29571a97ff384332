// Brings the nine directions together that neighbors of shade.frag look in, where they are about
// as deep.
uniform sampler2D shade;  // lamp, sky, depth in meters
out vec4 softened;        // lamp, sky

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(shade, 0) - 1;
  float depth = texelFetch(shade, at, 0).z;
  vec2 sum = vec2(0.0);
  float weights = 0.0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      vec3 there = texelFetch(shade, clamp(at + ivec2(x, y), ivec2(0), last), 0).xyz;
      float weight = max(1.0 - abs(there.z - depth) / (0.03 * depth), 0.001);
      sum += weight * there.xy;
      weights += weight;
    }
  }
  softened = vec4(sum / weights, 0.0, 1.0);
}
