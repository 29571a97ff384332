/// \file
/// Photographs as linear light. Cameras write gamma-encoded values, in which blur makes dark
/// squares shrink by 0.3 to 0.4 px a side; edges are therefore fitted to linear light.
#pragma once

#include <vector>

#include "calib/picture.hpp"

namespace afterglow::calib {

/// Row-major linear light, 1 for a saturated pixel (or any unit, for a quotient of two), with a
/// weight for each pixel.
struct Light {
  int width = 0, height = 0;
  std::vector<float> value;
  std::vector<float> weight;  ///< 1 / variance; 0 for saturated and black pixels
};

constexpr double kGrayNoise = 1.5;  ///< gray levels: the noise of 8-bit cameras' sensors
/// Decodes gamma 2.2; the weights come from kGrayNoise.
Light linearLight(const Picture& picture);

/// The light with the pattern divided by the light without it, pixel by pixel: the print on the
/// board, the uneven light and the camera's vignette cancel, the pattern remains. The weight is
/// lower where the plain image has edges, and 0 where one of the two has weight 0. Throws
/// std::invalid_argument unless both have one size.
Light quotient(const Light& pattern, const Light& plain);

/// Gamma-encoded gray levels for a detector, the 99th percentile of the light at 220.
Picture encoded(const Light& light);

}  // namespace afterglow::calib
