/// \file
/// The verb `afterglow said`: what the robot said.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kSaidHelp = "What the robot said and which sounds it played, newest first";

/// Registers the verb; parsing it does the job. Failures are exceptions.
void addSaidVerb(CLI::App& app);

}  // namespace afterglow::nodes
