/// \file
/// `afterglow calibrate verify`: a held-out check of a finished calibration, in millimeters.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

/// Registers the sub-verb; parsing it does the job. Failures are exceptions.
void addCalibrateVerify(CLI::App& calibrate);

}  // namespace afterglow::nodes
