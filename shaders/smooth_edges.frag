// Softens stairs: where brightness jumps between neighbors, mixes along the edge, as far as the
// jump is strong. In place of multisampling, which costs a CPU four times the shading.
// The idea is FXAA's (Lottes, NVIDIA 2009).
uniform sampler2D drawn;  // sRGB
out vec4 smoothed;

float luma(vec3 c) { return dot(c, vec3(0.30, 0.59, 0.11)); }

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(drawn, 0) - 1;
  vec3 here = texelFetch(drawn, at, 0).rgb;
  float nw = luma(texelFetch(drawn, max(at + ivec2(-1, -1), 0), 0).rgb);
  float ne = luma(texelFetch(drawn, clamp(at + ivec2(1, -1), ivec2(0), last), 0).rgb);
  float sw = luma(texelFetch(drawn, clamp(at + ivec2(-1, 1), ivec2(0), last), 0).rgb);
  float se = luma(texelFetch(drawn, min(at + ivec2(1, 1), last), 0).rgb);
  float middle = luma(here);
  float low = min(min(min(nw, ne), min(sw, se)), middle);
  float high = max(max(max(nw, ne), max(sw, se)), middle);
  // Along the edge: across the gradient.
  vec2 along = vec2(sw + se - nw - ne, nw + sw - ne - se);
  float flattest = min(abs(along.x), abs(along.y)) + 0.03 * (nw + ne + sw + se) + 0.008;
  along = clamp(along / flattest, -6.0, 6.0) / vec2(last + 1);
  vec2 uv = gl_FragCoord.xy / vec2(last + 1);
  vec3 near = 0.5 * (textureLod(drawn, uv - along / 6.0, 0.0).rgb +
                     textureLod(drawn, uv + along / 6.0, 0.0).rgb);
  vec3 far = 0.5 * near + 0.25 * (textureLod(drawn, uv - 0.5 * along, 0.0).rgb +
                                  textureLod(drawn, uv + 0.5 * along, 0.0).rgb);
  float reached = luma(far);
  vec3 mixed = reached < low || reached > high ? near : far;
  smoothed = vec4(high - low < max(0.02, 0.08 * high) ? here : mixed, 1.0);
}
