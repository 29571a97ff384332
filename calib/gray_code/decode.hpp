/// \file
/// The projector pixel that lights each pixel of the camera.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/gray_code/set.hpp"
#include "calib/picture.hpp"

namespace afterglow::calib {

/// The projector's pixel for each pixel of the photograph, row by row; NaN where it is not lit
/// directly or its stripes cannot be told from their inverse, infinite where its code belongs to no
/// pixel of a picture of the projector's size.
struct DecodedLight {
  int width = 0, height = 0;
  std::vector<Eigen::Vector2f> projector_px;

  const Eigen::Vector2f& at(int x, int y) const {
    return projector_px[std::size_t(y) * std::size_t(width) + std::size_t(x)];
  }
};

/// `pictures`: as `code` has them, of one size. A pixel on the edge between two stripes is taken as
/// exactly between them, which is half a pixel better than either. Pure.
DecodedLight decode(const std::vector<Picture>& pictures, const GrayCode& code);

}  // namespace afterglow::calib
