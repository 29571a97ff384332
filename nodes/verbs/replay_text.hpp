/// \file
/// What a replay did, as `afterglow play` says it at the end. Pure.
#pragma once

#include <string>
#include <vector>

#include "replay/play/play_report.hpp"

namespace afterglow::nodes {

/// Lines for 80 columns, as far as names allow.
std::string replayText(const replay::PlayReport& report);

/// What a person should know beside, a clause each: the scheduling unless it was SCHED_FIFO, the
/// notes, what of the end is not known.
std::vector<std::string> replayRemarks(const replay::PlayReport& report);

}  // namespace afterglow::nodes
