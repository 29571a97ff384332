// Vertices of solid things, into an eye's or a projector's pinhole image.
layout(location = 0) in vec3 p_world;  // meters
layout(location = 1) in vec3 n_world;  // normal, unit length, of either side
layout(location = 2) in vec4 color;    // sRGB paint

uniform mat4 P_clip_world;
uniform vec3 p_world_observer;

out vec3 point_world;
out vec3 normal_world;  // toward the observer
out vec3 albedo;        // linear
invariant gl_Position;  // two programs draw the same surface, the second where depths are equal

void main() {
  point_world = p_world;
  normal_world = dot(n_world, p_world_observer - p_world) < 0.0 ? -n_world : n_world;
  // White paint reflects 80 %, black ink 4 %: light shows on everything.
  albedo = 0.04 + 0.76 * linearFromSrgb(color.rgb);
  gl_Position = P_clip_world * vec4(p_world, 1.0);
}
