/// \file
/// What the drift watch says in /diagnostics.
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <string>

#include "calib/verify/drift.hpp"
#include "nodes/projector/watch_config.hpp"

namespace afterglow::nodes {

/// One look at the floor.
struct WatchLook {
  calib::Drift drift;
  std::string problem;  ///< why there was nothing to compare; empty if there was
};

/// OK; WARN with the median offset above a limit; STALE when there was nothing to compare, or no
/// known tag was seen. `age_s`: how long ago the look was.
diagnostic_msgs::DiagnosticStatus watchStatus(const std::string& node, const WatchConfig& config,
                                              const WatchLook& look, double age_s);

}  // namespace afterglow::nodes
