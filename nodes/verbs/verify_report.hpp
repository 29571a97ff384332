/// \file
/// The measurements of `afterglow calibrate verify`, as text and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calib/verify/layout_reader.hpp"
#include "calib/verify/view_check.hpp"

namespace afterglow::nodes {

/// Reports views of the board: {method: "views", views: [{name, corners, median_mm, p95_mm, max_mm,
/// fault}], corners, median_mm, p95_mm, max_mm}.
nlohmann::ordered_json verifyJson(const std::vector<calib::ViewCheck>& views);
std::string verifyText(const std::vector<calib::ViewCheck>& views);

/// Reports tags thrown on a surface: {method: "targets", printed_tags, printed_rms_px, targets:
/// [{id, seen, dx_mm, dy_mm, error_mm, max_mm}], corners, median_mm, p95_mm, max_mm}. dx and dy are
/// those of the target's middle along the surface's axes; median and so on are of all corners.
nlohmann::ordered_json verifyJson(const calib::ThrowCheck& check);
std::string verifyText(const calib::ThrowCheck& check);

calib::ErrorSummary summaryOf(const std::vector<calib::ViewCheck>& views);

}  // namespace afterglow::nodes
