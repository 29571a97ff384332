// The projector's lens, as calib/lens.hpp has it: optical frame (x right, y down, z forward, metres)
// to pixels, the centre of the top-left pixel being (0, 0).
uniform vec3 lens_focal;   // fx, fy, skew; px
uniform vec2 lens_center;  // cx, cy; px
uniform float lens_D[8];   // k1 k2 p1 p2 k3 k4 k5 k6

vec2 lensDistort(vec2 n) {
  float s = dot(n, n);
  float radial = (1.0 + s * (lens_D[0] + s * (lens_D[1] + s * lens_D[4]))) /
                 (1.0 + s * (lens_D[5] + s * (lens_D[6] + s * lens_D[7])));
  float p1 = lens_D[2], p2 = lens_D[3];
  return radial * n + vec2(2.0 * p1 * n.x * n.y + p2 * (s + 2.0 * n.x * n.x),
                           p1 * (s + 2.0 * n.y * n.y) + 2.0 * p2 * n.x * n.y);
}

vec2 lensPixel(vec3 p_optical) {
  vec2 d = lensDistort(p_optical.xy / p_optical.z);
  return vec2(lens_focal.x * d.x + lens_focal.z * d.y, lens_focal.y * d.y) + lens_center;
}

// GL counts from the pixel's corner: the one place that knows. Image rows go up in GL's window, so
// that reading it back gives the top row first.
vec2 windowFromPixel(vec2 pixel) { return pixel + 0.5; }
