// Vertices of solid things, into an eye's or a projector's pinhole image.
layout(location = 0) in vec3 p_world;   // metres
layout(location = 1) in vec3 n_world;   // normal, unit length, of either side
layout(location = 2) in vec4 color;     // sRGB paint

uniform mat4 P_clip_world;

out vec3 point_world;
out vec3 normal_world;
out vec4 paint;

void main() {
  point_world = p_world;
  normal_world = n_world;
  paint = color;
  gl_Position = P_clip_world * vec4(p_world, 1.0);
}
