/// \file
/// The difference between two colors: sRGB, CIELAB and CIEDE2000.
#pragma once

#include <Eigen/Core>

namespace afterglow::calib {

/// IEC 61966-2-1: the light of a coded value, 0 to 1, and back. Beyond 0 to 1 the curve goes on.
double lightOfSrgb(double coded);
double srgbOfLight(double light);

/// CIELAB of linear sRGB, its white being (1, 1, 1): CIE 15, D65.
Eigen::Vector3d labOf(const Eigen::Vector3d& light);

/// CIEDE2000 with all weights 1. Source: Sharma, Wu, Dalal, "The CIEDE2000 color-difference
/// formula: implementation notes, supplementary test data, and mathematical observations", Color
/// Research and Application 30 (2005). About 1 is just seen side by side.
double colorDifference(const Eigen::Vector3d& lab_a, const Eigen::Vector3d& lab_b);

}  // namespace afterglow::calib
