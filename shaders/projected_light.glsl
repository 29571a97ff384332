// A projector's light, as it was drawn before: linear RGB.
uniform sampler2D thrown;  // on the surfaces
uniform sampler2D beam;    // from the air before them; smaller than the picture

// A projector's primaries are purer than sRGB's.
vec3 thrownAt(ivec2 at) {
  vec3 light = texelFetch(thrown, at, 0).rgb;
  return mix(vec3(dot(light, vec3(0.30, 0.59, 0.11))), light, 1.22);
}

vec3 airAt(vec2 uv) { return textureLod(beam, uv, 0.0).rgb; }
