/// \file
/// Reports of replays as files.
#pragma once

#include <string>

#include "replay/play/play_report.hpp"

namespace afterglow::nodes {

/// The JSON, whatever strings it holds.
std::string reportJson(const replay::PlayReport& report, int indent);

/// Writes BEHAVIOR_TIME.json and .html, TIME being UTC to the second: 7_20261121T142005Z.json. A
/// second replay within it gets another name. A missing folder is made. Throws std::runtime_error,
/// one line.
void saveReport(const std::string& folder, const replay::PlayReport& report);

}  // namespace afterglow::nodes
