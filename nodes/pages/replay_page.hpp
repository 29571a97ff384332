/// \file
/// The page on replays for people. Pure: values in, text out.
#pragma once

#include <string>
#include <vector>

#include "replay/play/play_report.hpp"

namespace afterglow::nodes {

/// Makes a page that needs no network and no script, well-formed as XML. `date` is shown as it is.
std::string replayPage(const std::vector<replay::PlayReport>& reports, const std::string& date);

}  // namespace afterglow::nodes
