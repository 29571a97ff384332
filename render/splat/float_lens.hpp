/// \file
/// calib::project in floats and without branches: a loop over it becomes vector code.
#pragma once

#include <algorithm>
#include <array>

#include "calib/lens.hpp"

namespace afterglow::render {

/// Within 1e-3 px of calib::project on images of usual size.
struct FloatLens {
  explicit FloatLens(const calib::Lens& lens)
      : fx(static_cast<float>(lens.K(0, 0))),
        skew(static_cast<float>(lens.K(0, 1))),
        cx(static_cast<float>(lens.K(0, 2))),
        fy(static_cast<float>(lens.K(1, 1))),
        cy(static_cast<float>(lens.K(1, 2))),
        square_fold(static_cast<float>(std::min(lens.fold_radius * lens.fold_radius, 1e18))) {
    std::transform(lens.D.begin(), lens.D.end(), D.begin(),
                   [](double d) { return static_cast<float>(d); });
  }

  /// Pixel (the centre of the top-left one is (0, 0)) of normalized coordinates; means nothing
  /// where x^2 + y^2 > square_fold.
  void project(float x, float y, float& u, float& v) const {
    const float s = x * x + y * y;
    const float radial =
        (1 + s * (D[0] + s * (D[1] + s * D[4]))) / (1 + s * (D[5] + s * (D[6] + s * D[7])));
    const float dx = radial * x + 2 * D[2] * x * y + D[3] * (s + 2 * x * x);
    const float dy = radial * y + D[2] * (s + 2 * y * y) + 2 * D[3] * x * y;
    u = fx * dx + skew * dy + cx;
    v = fy * dy + cy;
  }

  float fx, skew, cx, fy, cy;
  float square_fold;
  std::array<float, 8> D;
};

}  // namespace afterglow::render
