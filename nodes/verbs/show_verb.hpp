/// \file
/// `afterglow show`: one behavior, its topics and its decoded messages.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kShowHelp = "Show a behavior, its topics, its messages";

/// Registers the verb; parsing it does the job. Failures are exceptions.
void addShowVerb(CLI::App& app);

}  // namespace afterglow::nodes
