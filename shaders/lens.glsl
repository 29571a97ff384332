// The projector's lens, as calib/lens.hpp has it: optical frame (x right, y down, z forward, meters)
// to pixels, the center of the top-left pixel being (0, 0).
uniform vec3 lens_focal;   // fx, fy, skew; px
uniform vec2 lens_center;  // cx, cy; px
uniform float lens_D[8];   // k1 k2 p1 p2 k3 k4 k5 k6; fisheye: k1 k2 k3 k4
uniform bool lens_is_fisheye;
uniform float lens_fold;   // beyond this distance from the axis, at z = 1, nothing is seen

// Up to 1: Abramowitz and Stegun, 4.4.49. Drivers' atan may be a hundred times coarser.
float lensArcTangent(float r) {
  const float a[9] = float[](1.0, -0.3333314528, 0.1999355085, -0.1420889944, 0.1065626393,
                             -0.0752896400, 0.0429096138, -0.0161657367, 0.0028662257);
  float sum = 0.0;
  for (int i = 8; i >= 0; --i) sum = a[i] + r * r * sum;
  return r * sum;
}

vec2 fisheyeDistort(vec2 n) {
  float r = length(n);
  float angle = r > 1.0 ? 1.57079633 - lensArcTangent(1.0 / r) : lensArcTangent(r);
  float t = angle * angle;
  float bent = angle * (1.0 + t * (lens_D[0] + t * (lens_D[1] + t * (lens_D[2] + t * lens_D[3]))));
  return r > 0.0 ? n * (bent / r) : n;
}

vec2 lensDistort(vec2 n) {
  if (lens_is_fisheye) return fisheyeDistort(n);
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
