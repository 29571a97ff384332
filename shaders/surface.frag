// What is seen of painted things: how they reflect, and which way they face.
in vec3 normal_world;
in vec3 albedo;

layout(location = 0) out vec4 reflected;  // root of the albedo
layout(location = 1) out vec4 facing;     // normal, -1 .. 1 as 0 .. 1; alpha 0: nothing is there

void main() {
  reflected = vec4(sqrt(albedo), 1.0);
  facing = vec4(0.5 + 0.5 * normalize(normal_world), 1.0);
}
