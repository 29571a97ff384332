/// \file
/// Photographs as light: what cameras write is gamma-encoded, and blur in encoded values makes dark
/// squares shrink by 0.3 to 0.4 px a side; edges are therefore fitted to linear light.
#pragma once

#include <vector>

#include "calib/picture.hpp"

namespace afterglow::calib {

/// Row-major linear light, 1 for a saturated pixel (or any unit, for a quotient of two), and how
/// far each pixel can be trusted.
struct Light {
  int width = 0, height = 0;
  std::vector<float> value;
  std::vector<float> weight;  ///< 1 / variance; 0 for pixels that say nothing (saturated, black)
};

/// Decodes gamma 2.2, with the sensor noise of kGreyNoise grey levels that 8-bit cameras have.
constexpr double kGreyNoise = 1.5;
Light linearLight(const Picture& picture);

/// The light of the pattern's picture over that of the plain one, pixel by pixel: what is printed
/// on the board, the falling-off of the light and the camera's vignette cancel, the pattern
/// remains. Trusted less where the plain picture has edges, and not at all where one of the two
/// says nothing. Both of one size (std::invalid_argument).
Light quotient(const Light& pattern, const Light& plain);

/// For a detector: encoded grey levels, the 99th percentile of the light at 220.
Picture encoded(const Light& light);

}  // namespace afterglow::calib
