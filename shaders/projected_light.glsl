// A projector's light on what is seen and in the air before it: linear RGB. Needs seen_point.glsl,
// lens.glsl, sent_light.glsl and srgb.glsl.
uniform mat4 T_world_observer;
uniform vec3 p_world_projector;
uniform mat4 P_shadow_optical;  // optical frame to the shadow map's clip coordinates
uniform float shadow_texel;     // size of a shadow map texel at a meter, meters
uniform float projector_gain;   // white light at a meter
uniform sampler2DShadow shadow_map;
uniform sampler2D beam;         // smaller than the picture

// How much of the projector is seen from there. The point is lifted off its surface by what a texel
// of the map spans there, so that a surface does not shade itself.
float unshaded(vec3 p_world, vec3 n_world, float z, float cosine) {
  float slope = sqrt(1.0 - min(cosine * cosine, 1.0)) / max(cosine, 0.1);
  vec3 lifted = p_world + n_world * (shadow_texel * z * (1.0 + 2.0 * slope) + 1e-3);
  vec4 clip = P_shadow_optical * (T_projector_world * vec4(lifted, 1.0));
  return textureLod(shadow_map, 0.5 + 0.5 * clip.xyz / clip.w, 0.0);
}

// Before the surface reflects it. A projector's primaries are purer than sRGB's.
vec3 thrownAt(ivec2 at, vec3 n_world) {
  vec3 p_world = (T_world_observer * vec4(pointAt(at, textureSize(depths, 0)), 1.0)).xyz;
  vec3 p_optical = (T_projector_world * vec4(p_world, 1.0)).xyz;
  vec3 to_projector = p_world_projector - p_world;
  float distance = length(to_projector);
  float cosine = max(dot(n_world, to_projector) / distance, 0.0);
  vec3 light = linearFromSrgb(sentLight(p_optical)) *
               (projector_gain * cosine / (distance * distance)) *
               unshaded(p_world, n_world, p_optical.z, cosine);
  return mix(vec3(dot(light, vec3(0.30, 0.59, 0.11))), light, 1.22);
}

vec3 airAt(vec2 uv) { return textureLod(beam, uv, 0.0).rgb; }
