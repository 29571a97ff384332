/// \file
/// The account of a replay, as `afterglow play` gives it at the end. Pure.
#pragma once

#include <string>
#include <vector>

#include "replay/play/play_report.hpp"

namespace afterglow::nodes {

/// Lines for 80 columns, as far as names allow.
std::string replayText(const replay::PlayReport& report);

/// Returns what a person should know beside, a clause each: the scheduling unless it was
/// SCHED_FIFO, the notes, what of the end is not known.
std::vector<std::string> replayRemarks(const replay::PlayReport& report);

}  // namespace afterglow::nodes
