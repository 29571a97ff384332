// Where what is seen lies, by the picture's depths: in the observer's frame, meters.
uniform sampler2D depths;  // of the picture
uniform vec2 ray_span;     // tangents of half the view's angles, across and down
uniform float near;        // of the picture's depths, meters

vec3 pointAt(ivec2 at, ivec2 size) {
  float z = near / max(1.0 - texelFetch(depths, at, 0).r, 1e-4);
  return vec3((2.0 * (vec2(at) + 0.5) / vec2(size) - 1.0) * ray_span * z, z);
}
