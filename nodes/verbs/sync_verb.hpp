/// \file
/// `afterglow sync`: behaviors from one store to another.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kSyncHelp =
    "Copy behaviors from one store to another; repeat it to go on where it broke off";

/// Registers the verb; parsing it does the job. Failures are exceptions.
void addSyncVerb(CLI::App& app);

}  // namespace afterglow::nodes
