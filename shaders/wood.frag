// As surface.frag, of wood: boards along the world's y, each of its own tone, with grain.
in vec3 point_world;
in vec3 normal_world;
in vec3 albedo;

layout(location = 0) out vec4 reflected;
layout(location = 1) out vec4 facing;

void main() {
  const float kBoard = 0.124, kRing = 0.017;  // meters
  float across = point_world.x + 0.31 * point_world.z, along = point_world.y;
  float board = floor(across / kBoard);
  float tone = fract(43.7585 * sin(12.9898 * board));
  float bend = 0.010 * sin(3.7 * along + 9.0 * tone) + 0.003 * sin(13.0 * along + 5.0 * board);
  // Rings are not equally wide.
  float ring = (across + bend) / kRing + 3.0 * tone + 1.1 * sin(61.0 * across + 7.0 * tone);
  float grain = abs(2.0 * fract(ring) - 1.0);
  grain *= grain * clamp(1.4 - 1.6 * fwidth(ring), 0.0, 1.0);  // gone before it flickers
  float from_seam = abs(across - kBoard * (board + 0.5)) / kBoard;
  float seam = clamp((from_seam - 0.485) * 90.0, 0.0, 1.0);
  vec3 wood = albedo * (0.86 + 0.24 * tone) * (1.0 - 0.45 * seam);
  wood *= mix(vec3(1.0), vec3(0.84, 0.76, 0.68), grain);
  reflected = vec4(sqrt(wood), 1.0);
  facing = vec4(0.5 + 0.5 * normalize(normal_world), 1.0);
}
