// A dimmed room's own light, and how light is seen. Linear RGB in between. The sRGB curves are
// fitted by roots and powers (error < 2.5 % of white, at the darkest): pow is slow on a CPU.
vec3 linearFromSrgb(vec3 c) { return c * (0.0125 + c * (0.6822 + c * 0.3053)); }
vec3 srgbFromLinear(vec3 c) { return 1.139 * sqrt(c) - 0.139 * c; }

// A soft sky and one lamp.
vec3 roomLight(vec3 n_world) {
  const vec3 from_above = vec3(0.140, 0.146, 0.168), from_below = vec3(0.064, 0.059, 0.056);
  const vec3 lamp = vec3(0.135, 0.121, 0.100), n_lamp = vec3(0.337, -0.433, 0.836);
  return mix(from_below, from_above, 0.5 + 0.5 * n_world.z) +
         lamp * max(dot(n_world, n_lamp), 0.0);
}

// An eye's shoulder: bright light clips to white gently.
vec3 seenColor(vec3 light) {
  return srgbFromLinear(min(light / (1.0 + 0.45 * max(light - 0.45, 0.0)), 1.0));
}
