// How much of the room's lamp (x) and sky (y) reaches what is seen, at a third of the picture's
// size, and how deep that is (z). Neighbors look in different directions: soften_shade.frag brings
// them together.
uniform sampler2D facing;         // normals of the picture, in the world
uniform sampler2DShadow lamp_depths;
uniform mat4 R_observer_world;
uniform mat4 P_lamp_observer;     // observer's frame to the lamp map's clip coordinates
uniform float lamp_reach;         // half of what the lamp's map shows, meters
uniform float lamp_texel;         // meters
uniform vec3 to_lamp;             // in the observer's frame

out vec4 shade;

const int kLooks = 6;
const vec2 kAside[kLooks] = vec2[](
    vec2(0.100, 0.000), vec2(-0.197, 0.180), vec2(0.038, -0.432),
    vec2(0.365, 0.476), vec2(-0.755, -0.134), vec2(0.787, -0.501));  // a spiral
const float kReach = 0.32;  // meters; what is farther away takes no sky

float skyAt(vec3 p, vec3 n, ivec2 at, ivec2 size, vec2 turn) {
  float height = float(size.y);
  float reach_px = clamp(0.5 * height * kReach / (ray_span.y * p.z), 4.0, 0.2 * height);
  mat2 turned = reach_px * mat2(turn, vec2(-turn.y, turn.x));
  float taken = 0.0;
  for (int i = 0; i < kLooks; ++i) {
    ivec2 there = clamp(at + ivec2(turned * kAside[i]), ivec2(0), size - 1);
    vec3 v = pointAt(there, size) - p;
    float far = dot(v, v);
    float up = max(dot(v, n) * inversesqrt(far + 1e-8) - 0.08, 0.0);
    taken += up * max(1.0 - far / (kReach * kReach), 0.0);
  }
  return max(1.0 - 2.5 * taken / float(kLooks), 0.12);
}

// Lifted off the surface by what the look aside spans there: no surface shades itself.
float lampAt(vec3 p, vec3 n, vec2 turn) {
  const float kSoft = 0.022;  // meters
  float lift = 0.8 * lamp_texel + kSoft * length(cross(n, to_lamp));
  vec4 clip = P_lamp_observer * vec4(p + lift * n, 1.0);
  vec2 aside = (0.5 * kSoft / lamp_reach) * turn;
  return textureLod(lamp_depths, 0.5 + 0.5 * clip.xyz + vec3(aside, 0.0), 0.0);
}

void main() {
  ivec2 here = ivec2(gl_FragCoord.xy), size = textureSize(depths, 0);
  ivec2 at = min(3 * here + 1, size - 1);
  vec3 p = pointAt(at, size);
  vec3 n = mat3(R_observer_world) * (2.0 * texelFetch(facing, at, 0).xyz - 1.0);
  float angle = 0.698 * float(3 * (here.x % 3) + here.y % 3);
  vec2 turn = vec2(cos(angle), sin(angle));
  shade = vec4(lampAt(p, n, turn), skyAt(p, n, at, size, turn), p.z, 1.0);
}
