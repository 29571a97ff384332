/// \file
/// Options of `afterglow play` for what moves the robot.
#pragma once

#include <CLI/App.hpp>

#include "nodes/player/body_gate.hpp"

namespace afterglow::nodes {

/// `body` has to live until the command line is read.
void addBodyOptions(CLI::App& verb, BodyOptions& body);

}  // namespace afterglow::nodes
