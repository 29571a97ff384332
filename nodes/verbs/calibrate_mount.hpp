/// \file
/// `afterglow calibrate mount`: where the projector sits on the robot, as a static transform.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

/// Registers the sub-verb; parsing it does the job. Failures are exceptions.
void addCalibrateMount(CLI::App& calibrate);

}  // namespace afterglow::nodes
