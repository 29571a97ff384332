// What a projector sends to a point in its optical frame: sRGB. Needs lens.glsl.
uniform mat4 T_projector_world;
uniform sampler2D projector_image;  // sRGB, top row first

vec3 sentLight(vec3 p_optical) {
  vec2 size = vec2(textureSize(projector_image, 0));
  vec2 window = windowFromPixel(lensPixel(p_optical));
  bool outside = p_optical.z <= 0.02 || length(p_optical.xy) > lens_fold * p_optical.z ||
                 any(lessThan(window, vec2(0.0))) || any(greaterThan(window, size));
  return outside ? vec3(0.0) : textureLod(projector_image, window / size, 0.0).rgb;
}
