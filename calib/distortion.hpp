/// \file
/// The numbers of a lens's distortion as others write them.
#pragma once

#include <string>
#include <vector>

namespace afterglow::calib {

/// The numbers of D that this distortion_model has: plumb_bob 5, rational_polynomial 8, equidistant
/// and fisheye 4, others all. Drivers send more (OpenCV's 14), which must be 0. Throws
/// std::invalid_argument, without a key: one of them is not, or there are too few (plumb_bob may
/// have 4 or none).
std::vector<double> usedDistortion(const std::string& distortion_model, std::vector<double> D);

}  // namespace afterglow::calib
