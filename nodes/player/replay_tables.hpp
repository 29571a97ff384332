/// \file
/// What a replay measured, in tables of HTML. Empty where nothing was.
#pragma once

#include <string>

#include "replay/play/play_report.hpp"

namespace afterglow::nodes {

std::string topicTable(const replay::PlayReport& report);
/// Topics that were left alone, and why.
std::string notPlayedTable(const replay::PlayReport& report);
std::string rewriteTable(const replay::PlayReport& report);
/// The longest.
std::string waitTable(const replay::PlayReport& report);
std::string jointTable(const replay::PlayReport& report);

}  // namespace afterglow::nodes
