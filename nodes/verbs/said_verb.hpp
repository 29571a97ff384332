/// \file
/// The verb `afterglow said`: what the robot said.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

void addSaidVerb(CLI::App& app);

}  // namespace afterglow::nodes
