/// \file
/// calib::project in floats and without branches: a loop over it becomes vector code.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/lens.hpp"

namespace afterglow::render {

/// A corner on the image; pixel i spans [i, i + 1).
struct Corner {
  float x, y;
};

/// A lens within 1e-3 px of calib::project on images of usual size.
struct FloatLens {
  explicit FloatLens(const calib::Lens& lens)
      : fx(static_cast<float>(lens.K(0, 0))),
        skew(static_cast<float>(lens.K(0, 1))),
        cx(static_cast<float>(lens.K(0, 2))),
        fy(static_cast<float>(lens.K(1, 1))),
        cy(static_cast<float>(lens.K(1, 2))),
        square_fold(static_cast<float>(std::min(lens.fold_radius * lens.fold_radius, 1e18))),
        is_fisheye(lens.model == calib::LensModel::Equidistant) {
    std::transform(lens.D.begin(), lens.D.end(), D.begin(),
                   [](double d) { return static_cast<float>(d); });
  }

  /// Pixel (the center of the top-left one is (0, 0)) of normalized coordinates; means nothing
  /// where x^2 + y^2 > square_fold. kFisheye is is_fisheye: a decision made once, before the loop.
  template <bool kFisheye>
  void project(float x, float y, float& u, float& v) const {
    const float s = x * x + y * y;
    const float factor = kFisheye ? fisheyeFactor(s) : calib::radialFactor(D, s);
    // A fisheye has no tangential terms; D[2] and D[3] are others there.
    const auto [dx, dy] =
        calib::distorted(x, y, factor, kFisheye ? 0.f : D[2], kFisheye ? 0.f : D[3]);
    u = fx * dx + skew * dy + cx;
    v = fy * dy + cy;
  }

  /// The same as a corner.
  template <bool kFisheye>
  Corner seen(float x, float y) const {
    Corner corner;
    project<kFisheye>(x, y, corner.x, corner.y);
    return {corner.x + 0.5f, corner.y + 0.5f};
  }
  Corner seen(float x, float y) const { return is_fisheye ? seen<true>(x, y) : seen<false>(x, y); }

  float fx, skew, cx, fy, cy;
  float square_fold;
  bool is_fisheye;  ///< calib::LensModel::Equidistant
  std::array<float, 8> D;

 private:
  /// Distorted by undistorted radius, of the latter's square.
  float fisheyeFactor(float s) const {
    const float r = std::sqrt(s);
    const float angle = s > 1 ? 1.57079633f - arcTangent(1 / r) : arcTangent(r);
    return r > 0 ? calib::equidistantRadius(D, angle) / r : 1;
  }
  /// Up to 1, within 2e-8: Abramowitz and Stegun, 4.4.49. shaders/lens.glsl has it too.
  static float arcTangent(float r) {
    const float s = r * r;
    return r * (1 + s * (-0.3333314528f +
                         s * (0.1999355085f +
                              s * (-0.1420889944f +
                                   s * (0.1065626393f +
                                        s * (-0.0752896400f +
                                             s * (0.0429096138f +
                                                  s * (-0.0161657367f + s * 0.0028662257f))))))));
  }
};

}  // namespace afterglow::render
