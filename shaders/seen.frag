// What a bystander's camera sees of surfaces in the room's and the projector's light, as sRGB.
// Needs room_light.glsl, srgb.glsl and projected_light.glsl.
uniform sampler2D reflected;   // root of the albedo
uniform sampler2D facing;      // normals in the world; alpha 0: nothing is there
uniform sampler2D reached;     // lamp and sky; smaller than the picture
uniform vec3 background;       // sRGB

out vec4 seen;

// A camera's shoulder. The strongest channel bends and takes the others along: bright light keeps
// its hue instead of clipping to white.
vec3 exposed(vec3 light) {
  float most = max(max(light.r, light.g), max(light.b, 1e-4));
  float kept = most < 0.55 ? most : 0.55 + 0.45 * (1.0 - 0.45 / (most - 0.10));
  return light * (min(kept, 1.0) / most);
}

// Half a level of noise, so that dark slopes show no bands (Jimenez 2014).
float noise(vec2 p) {
  return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))) - 0.5;
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec2 uv = gl_FragCoord.xy / vec2(textureSize(reflected, 0));
  vec4 normal = texelFetch(facing, at, 0);
  vec3 albedo = texelFetch(reflected, at, 0).rgb;
  albedo *= albedo;
  vec2 shade = textureLod(reached, uv, 0.0).rg;
  vec3 n_world = normalize(2.0 * normal.xyz - 1.0);
  vec3 light = roomLight(2.0 * normal.xyz - 1.0, shade) + thrownAt(at, n_world);
  vec2 aside = uv - 0.5;
  float vignette = 1.0 - 0.55 * dot(aside, aside);
  vec3 behind = normal.a == 0.0 ? linearFromSrgb(background) : albedo * light * vignette;
  vec3 shown = srgbFromLinear(exposed(max(behind + airAt(uv), 0.0)));
  seen = vec4(shown + noise(gl_FragCoord.xy) / 255.0, 1.0);
}
