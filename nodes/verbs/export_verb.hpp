/// \file
/// `afterglow export`: behaviors as a bag.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kExportHelp = "Export behaviors as a bag";

/// Registers the verb; parsing it does the job. Failures are exceptions.
void addExportVerb(CLI::App& app);

}  // namespace afterglow::nodes
