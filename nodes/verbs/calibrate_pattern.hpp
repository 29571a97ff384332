/// \file
/// `afterglow calibrate pattern`: the picture of tags to project.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

/// Registers the sub-verb; parsing it does the job. Failures are exceptions.
void addCalibratePattern(CLI::App& calibrate);

}  // namespace afterglow::nodes
