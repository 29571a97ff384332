// The projector's light on the dust in the air, as far as it is seen before what is behind it, and
// the halo of what it lights: linear RGB, at a quarter of the picture's size.
uniform sampler2D depths;              // of the picture
uniform sampler2D glow;                // what the projector sends, blurred; linear
uniform sampler2DShadow shadow_map;    // depths from the projector
uniform vec2 ray_span;                 // tangents of half the view's angles, across and down
uniform float near;                    // of the picture's depths, meters
uniform mat4 P_shadow_observer;        // observer's frame to the shadow map's clip coordinates
uniform float dust;                    // light that a meter of air sends on
uniform sampler2D halo;                // blurred; smaller than this
uniform float glare;                   // share of the light that is seen around it

out vec4 beam;

const int kSteps = 16;

void main() {
  ivec2 size = textureSize(depths, 0);
  ivec2 at = min(4 * ivec2(gl_FragCoord.xy) + 2, size - 1);
  vec3 ray = vec3((2.0 * (vec2(at) + 0.5) / vec2(size) - 1.0) * ray_span, 1.0);
  // In clip coordinates the ray is start + t * ahead; it is inside where |x| and |y| are below w.
  vec4 start = P_shadow_observer[3], ahead = P_shadow_observer * vec4(ray, 0.0);
  vec4 d0 = vec4(start.w + start.xy, start.w - start.xy);
  vec4 d1 = vec4(ahead.w + ahead.xy, ahead.w - ahead.xy);
  float t0 = 0.0, t1 = near / max(1.0 - texelFetch(depths, at, 0).r, 0.006);
  for (int i = 0; i < 4; ++i) {
    float crossing = -d0[i] / (abs(d1[i]) < 1e-6 ? 1e-6 : d1[i]);
    t0 = d1[i] > 0.0 ? max(t0, crossing) : t0;
    t1 = d1[i] > 0.0 ? t1 : min(t1, crossing);
  }
  vec3 sum = vec3(0.0);
  float pace = max(t1 - t0, 0.0) / float(kSteps);
  float turn = 0.25 * float((int(gl_FragCoord.x) & 1) * 2 + (int(gl_FragCoord.y) & 1));
  for (int i = 0; i < kSteps; ++i) {
    vec4 clip = start + (t0 + (float(i) + 0.125 + turn) * pace) * ahead;
    vec3 there = 0.5 + 0.5 * clip.xyz / max(clip.w, 1e-3);
    vec3 light = textureLod(glow, there.xy, 0.0).rgb * textureLod(shadow_map, there, 0.0);
    sum += clip.w > 0.0 ? light / (clip.w * clip.w + 0.10) : vec3(0.0);
  }
  vec3 around = glare * textureLod(halo, (vec2(at) + 0.5) / vec2(size), 0.0).rgb;
  beam = vec4(sum * (pace * length(ray) * dust) + around, 1.0);
}
