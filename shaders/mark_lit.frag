// Keeps the fragments that a projector may send light to.
in vec3 point_world;

uniform mat4 P_shadow_world;  // clip coordinates of the frustum around the projector's light
uniform sampler2D lit_mask;   // black where there is none; black beyond its border

void main() {
  vec4 clip = P_shadow_world * vec4(point_world, 1.0);
  if (clip.w < 0.02 || textureLod(lit_mask, 0.5 + 0.5 * clip.xy / clip.w, 0.0).r == 0.0) discard;
}
