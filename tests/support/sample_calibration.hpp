/// \file
/// A made-up calibration as a good solve gives it: consistent geometry, honest covariance.
#pragma once

#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::test {

/// A projector with lens shift (principal point below its picture), 16 views of an A2 board of
/// which the last two are left out, one outlier. The same every time.
calib::Calibration sampleCalibration();

/// What a camera might have seen: gray gradients with the corners' squares. Names match the views.
std::vector<calib::Photographs> samplePhotographs(const calib::Calibration& calibration);

}  // namespace afterglow::test
