// Solid things in a dimmed room with a projector's light on them, as sRGB.
in vec3 point_world;
in vec3 normal_world;
in vec4 paint;

uniform vec3 p_world_observer;

out vec4 seen;

void main() {
  vec3 n_world = normalize(normal_world);
  if (dot(n_world, p_world_observer - point_world) < 0.0) n_world = -n_world;
  // White paint reflects 80 %, black ink 3 %: light shows on everything.
  vec3 albedo = 0.03 + 0.77 * linearFromSrgb(paint.rgb);
  vec3 light = albedo * (roomLight(n_world) + projectedLight(point_world, n_world));
  // An eye's shoulder: bright light loses its hue last, and clips to white gently.
  vec3 exposed = 1.6 * light;
  seen = vec4(srgbFromLinear(exposed / (1.0 + max(exposed - 0.6, 0.0) * 0.55)), 1.0);
}
