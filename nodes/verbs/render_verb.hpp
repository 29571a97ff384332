/// \file
/// `afterglow render`: what a projector showed, or would have shown, during a recorded behavior, as
/// a picture or a video. Needs no ROS master.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kRenderHelp =
    "Draw what a projector showed during a behavior, without a ROS master";

/// Registers the verb; parsing it does the job. Failures are exceptions.
void addRenderVerb(CLI::App& app);

}  // namespace afterglow::nodes
