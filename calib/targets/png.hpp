/// \file
/// Pictures as PNG in memory.
#pragma once

#include <Eigen/Core>
#include <string>

#include "calib/picture.hpp"

namespace afterglow::calib {

/// 8 bit gray, no alpha. With a size the file says how many pixels a meter has, so that printing
/// programs get it right. Throws std::runtime_error if it cannot be encoded.
std::string encodePng(const Picture& picture,
                      const Eigen::Vector2d& size_m = Eigen::Vector2d::Zero());

}  // namespace afterglow::calib
