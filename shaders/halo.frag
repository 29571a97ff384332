// The projector's light that what is seen sends on, at an eighth of the picture's size: linear RGB,
// to be blurred. Needs srgb.glsl, seen_point.glsl, lens.glsl, sent_light.glsl and
// projected_light.glsl.
uniform sampler2D reflected;  // root of the albedo
uniform sampler2D facing;     // normals in the world; alpha 0: nothing is there

out vec4 light;

void main() {
  ivec2 at = min(8 * ivec2(gl_FragCoord.xy) + 4, textureSize(reflected, 0) - 1);
  vec3 albedo = texelFetch(reflected, at, 0).rgb;
  vec4 normal = texelFetch(facing, at, 0);
  light = vec4(normal.a * albedo * albedo * thrownAt(at, normalize(2.0 * normal.xyz - 1.0)), 1.0);
}
