// Lays what paint_points.comp has painted over the rest.
layout(std430, binding = 5) readonly buffer Painted { uint painted[]; };

uniform ivec2 image_size;

out vec4 light;

void main() {
  int pixel = int(gl_FragCoord.y) * image_size.x + int(gl_FragCoord.x);
  light = unpackUnorm4x8(painted[4 * pixel + gl_SampleID]);
  if (light.a == 0.0) discard;
}
