/// \file
/// `afterglow calibrate solve`: from a folder of photographs to projector.yaml,
/// T_camera_projector.yaml and report.html.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

void addCalibrateSolve(CLI::App& calibrate);

}  // namespace afterglow::nodes
