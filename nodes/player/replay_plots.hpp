/// \file
/// What a replay did over its time, in pictures: SVG in HTML. Empty where nothing was measured.
#pragma once

#include <string>

#include "replay/play/play_report.hpp"

namespace afterglow::nodes {

/// For each topic what was recorded (where it would be had nothing waited) above what was sent;
/// goals as bars; while the timeline stood it is shaded.
std::string lanePlot(const replay::PlayReport& report);
/// How late messages were, on a logarithmic scale, with each modality's worst p99.
std::string latenessPlot(const replay::PlayReport& report);
/// How far light and speech were from the body.
std::string skewPlot(const replay::PlayReport& report);
/// How far off its recorded way the base was.
std::string deviationPlot(const replay::PlayReport& report);

}  // namespace afterglow::nodes
