// A dimmed room's own light: a soft sky and one lamp, linear RGB.
vec3 roomLight(vec3 n_world) {
  const vec3 from_above = vec3(0.20, 0.21, 0.235), from_below = vec3(0.10, 0.092, 0.085);
  const vec3 lamp = vec3(0.15, 0.14, 0.125), n_lamp = normalize(vec3(0.35, -0.45, 0.82));
  return mix(from_below, from_above, 0.5 + 0.5 * n_world.z) +
         lamp * max(dot(n_world, n_lamp), 0.0);
}

vec3 linearFromSrgb(vec3 c) {
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}

vec3 srgbFromLinear(vec3 c) {
  return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
