/// \file
/// The formulas of distortion, for doubles and for the floats of a drawing's inner loops; once more
/// in shaders/lens.glsl.
#pragma once

#include <array>

namespace afterglow::calib {

/// Brown-Conrady's radial factor, by the squared radius.
template <typename Number>
Number radialFactor(const std::array<Number, 8>& D, Number s) {
  return (1 + s * (D[0] + s * (D[1] + s * D[4]))) / (1 + s * (D[5] + s * (D[6] + s * D[7])));
}
/// Moves x and y by a radial factor and by p1 and p2.
template <typename Number>
std::array<Number, 2> distorted(Number x, Number y, Number factor, Number p1, Number p2) {
  const Number s = x * x + y * y;
  return {factor * x + (2 * p1 * x * y + p2 * (s + 2 * x * x)),
          factor * y + (p1 * (s + 2 * y * y) + 2 * p2 * x * y)};
}
/// Kannala-Brandt's distorted radius, by the ray's angle to the axis in radians.
template <typename Number>
Number equidistantRadius(const std::array<Number, 8>& D, Number angle) {
  const Number s = angle * angle;
  return angle * (1 + s * (D[0] + s * (D[1] + s * (D[2] + s * D[3]))));
}

}  // namespace afterglow::calib
