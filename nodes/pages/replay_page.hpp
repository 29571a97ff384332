/// \file
/// The page of replays for people, with its plots. Pure: values in, text out.
#pragma once

#include <string>
#include <vector>

#include "nodes/pages/page.hpp"
#include "replay/play/play_report.hpp"

namespace afterglow::nodes {

/// Plots for each topic what was recorded (where it would be had nothing waited) above what was
/// sent; goals as bars; while the timeline stood it is shaded.
PageData lanePlot(const replay::PlayReport& report);
/// Plots the lateness of messages, on a logarithmic scale, with each modality's worst p99.
PageData latenessPlot(const replay::PlayReport& report);
/// Plots how far light and speech were from the body.
PageData skewPlot(const replay::PlayReport& report);
/// Plots how far off its recorded way the base was.
PageData deviationPlot(const replay::PlayReport& report);

/// Makes a page that needs no network and no script, well-formed as XML. `date` is shown as it is.
std::string replayPage(const std::vector<replay::PlayReport>& reports, const std::string& date);

/// The JSON, whatever strings it holds.
std::string reportJson(const replay::PlayReport& report, int indent);

/// Writes BEHAVIOR_TIME.json and .html, TIME being UTC to the second: 7_20261121T142005Z.json. A
/// second replay within it gets another name. A missing folder is made. Throws std::runtime_error,
/// one line.
void saveReport(const std::string& folder, const replay::PlayReport& report);

}  // namespace afterglow::nodes
