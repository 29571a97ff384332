// A projector's light on solid things: linear RGB on their surface, before they reflect it.
in vec3 point_world;
in vec3 normal_world;

uniform vec3 p_world_projector;
uniform mat4 P_shadow_optical;  // optical frame to the shadow map's clip coordinates
uniform float shadow_texel;     // size of a shadow map texel at a meter, meters
uniform float projector_gain;   // white light at a meter
uniform sampler2DShadow shadow_map;

out vec4 thrown;

// How much of the projector is seen from here. The point is lifted off its surface by what a texel
// of the map spans there, so that a surface does not shade itself.
float unshaded(vec3 n_world, float z, float cosine) {
  float slope = sqrt(1.0 - min(cosine * cosine, 1.0)) / max(cosine, 0.1);
  vec3 lifted = point_world + n_world * (shadow_texel * z * (1.0 + 2.0 * slope) + 1e-3);
  vec4 clip = P_shadow_optical * (T_projector_world * vec4(lifted, 1.0));
  return textureLod(shadow_map, 0.5 + 0.5 * clip.xyz / clip.w, 0.0);
}

void main() {
  vec3 p_optical = (T_projector_world * vec4(point_world, 1.0)).xyz;
  vec3 n_world = normalize(normal_world);
  vec3 to_projector = p_world_projector - point_world;
  float distance = length(to_projector);
  float cosine = max(dot(n_world, to_projector) / distance, 0.0);
  vec3 light = linearFromSrgb(sentLight(p_optical)) *
               (projector_gain * cosine / (distance * distance)) *
               unshaded(n_world, p_optical.z, cosine);
  thrown = vec4(light, 1.0);
}
