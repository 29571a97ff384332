// The light of a room that is darkened for a projection. Linear RGB.

// One lamp above, a soft sky, and what the walls throw back from the other side. `reached` is how
// much of the lamp (x) and of the sky (y) is seen from there.
vec3 roomLight(vec3 n_world, vec2 reached) {
  const vec3 from_above = vec3(0.100, 0.112, 0.142), from_below = vec3(0.052, 0.051, 0.052);
  const vec3 lamp = vec3(0.300, 0.258, 0.200), n_lamp = vec3(-0.503, 0.121, 0.856);
  const vec3 thrown_back = vec3(0.050, 0.060, 0.082), n_back = vec3(0.545, 0.800, 0.250);
  vec3 sky = mix(from_below, from_above, 0.5 + 0.5 * n_world.z);
  vec3 back = thrown_back * max(0.4 + 0.6 * dot(n_world, n_back), 0.0);
  // The lamp is a wide one: what takes the sky takes some of it, too.
  float lit = reached.x * max(dot(n_world, n_lamp), 0.0) * (0.55 + 0.45 * reached.y);
  return 0.145 * (reached.y * (sky + back) + lit * lamp);
}
