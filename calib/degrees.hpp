/// \file
/// Radians inside, degrees for people.
#pragma once

namespace afterglow::calib {

constexpr double kDegrees = 180 / 3.14159265358979323846;  ///< in one radian

}  // namespace afterglow::calib
