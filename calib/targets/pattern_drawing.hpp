/// \file
/// A projector's calibration pattern as the picture it is to show.
#pragma once

#include <string>

#include "calib/picture.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

/// Black (0) and white (255) and nothing between. Throws std::invalid_argument for a tag that the
/// family does not have.
Picture patternPicture(const Pattern& pattern);

std::string patternPng(const Pattern& pattern);

}  // namespace afterglow::calib
