// Solid things in a dimmed room, as sRGB.
in vec3 normal_world;
in vec3 albedo;
out vec4 seen;

void main() { seen = vec4(seenColor(albedo * roomLight(normalize(normal_world))), 1.0); }
