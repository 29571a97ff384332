/// \file
/// `afterglow play`: a behavior replayed into the running robot, or its plan shown.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kPlayHelp = "Replay a behavior into the running robot";

/// Registers the verb; parsing it does the job. Failures are exceptions.
void addPlayVerb(CLI::App& app);

}  // namespace afterglow::nodes
