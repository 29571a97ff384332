// Light that a projector throws on a point of the room: linear RGB, white at a metre being
// projector_gain. Needs lens.glsl and room_light.glsl.
uniform bool projector_on;
uniform mat4 T_projector_world;
uniform vec3 p_world_projector;
uniform mat4 P_shadow_optical;  // optical frame to the shadow map's clip coordinates
uniform float shadow_texel;     // size of a shadow map texel at a metre, metres
uniform float fold_radius;
uniform float projector_gain;
uniform sampler2D projector_image;  // sRGB, top row first
uniform sampler2DShadow shadow_map;

// How much of the projector is seen from here. The point is lifted off its surface by what a texel
// of the map spans there, so that a surface does not shade itself.
float unshaded(vec3 point_world, vec3 n_world, float z, float slope) {
  vec3 lifted = point_world + n_world * (shadow_texel * z * (1.0 + 2.0 * slope) + 1e-3);
  vec4 clip = P_shadow_optical * (T_projector_world * vec4(lifted, 1.0));
  return texture(shadow_map, 0.5 + 0.5 * clip.xyz / clip.w);
}

vec3 projectedLight(vec3 point_world, vec3 n_world) {
  if (!projector_on) return vec3(0.0);
  vec3 p_optical = (T_projector_world * vec4(point_world, 1.0)).xyz;
  if (p_optical.z <= 0.02 || length(p_optical.xy) > fold_radius * p_optical.z) return vec3(0.0);
  vec3 to_projector = p_world_projector - point_world;
  float distance = length(to_projector);
  float cosine = dot(n_world, to_projector) / distance;
  if (cosine <= 0.0) return vec3(0.0);
  vec2 size = vec2(textureSize(projector_image, 0));
  vec2 window = windowFromPixel(lensPixel(p_optical));
  if (any(lessThan(window, vec2(0.0))) || any(greaterThan(window, size))) return vec3(0.0);
  vec3 sent = texture(projector_image, window / size).rgb;
  if (sent == vec3(0.0)) return vec3(0.0);
  float slope = sqrt(1.0 - min(cosine * cosine, 1.0)) / max(cosine, 0.1);
  return linearFromSrgb(sent) * (projector_gain * cosine / (distance * distance)) *
         unshaded(point_world, n_world, p_optical.z, slope);
}
