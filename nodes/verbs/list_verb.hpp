/// \file
/// `afterglow list`: the store's behaviors, by name, outcome, time, topic.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kListHelp = "List behaviors, newest first";

/// Registers the verb; parsing it does the job. Failures are exceptions.
void addListVerb(CLI::App& app);

}  // namespace afterglow::nodes
