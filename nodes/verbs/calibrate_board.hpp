/// \file
/// `afterglow calibrate board`: the sheet of tags to print.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

/// Registers the sub-verb; parsing it does the job. Failures are exceptions.
void addCalibrateBoard(CLI::App& calibrate);

}  // namespace afterglow::nodes
