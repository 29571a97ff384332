#include "nodes/projector/watch_status.hpp"

#include "calib/number_text.hpp"
#include "nodes/tools/diagnostics.hpp"

namespace afterglow::nodes {
namespace {

using calib::fixedText;
using diagnostic_msgs::DiagnosticStatus;

std::string offsetText(double px, double mm) {
  return fixedText(px, 1) + " px, " + fixedText(mm, 1) + " mm";
}

std::string limitText(const WatchConfig& config) {
  std::string text;
  if (config.limit_px) text = fixedText(*config.limit_px, 1) + " px";
  if (config.limit_mm) text += (text.empty() ? "" : ", ") + fixedText(*config.limit_mm, 1) + " mm";
  return text;
}

void judge(const WatchConfig& config, const calib::Drift& drift, DiagnosticStatus& status) {
  const std::string seen = std::to_string(drift.seen.size());
  if (drift.seen.empty()) {
    status.level = DiagnosticStatus::STALE;
    status.message = drift.expected == 0 ? "no known tag should be in the camera's view now"
                                         : "none of the " + std::to_string(drift.expected) +
                                               " tags that should be in the camera's view is seen";
    return;
  }
  const bool has_drifted = (config.limit_px && drift.median_px > *config.limit_px) ||
                           (config.limit_mm && drift.median_mm > *config.limit_mm);
  const std::string offset = offsetText(drift.median_px, drift.median_mm);
  status.level = has_drifted ? DiagnosticStatus::WARN : DiagnosticStatus::OK;
  status.message = has_drifted ? "drift: " + seen + " tags are off by " + offset + " (limit " +
                                     limitText(config) + "); localize the robot, or calibrate again"
                               : seen + " tags within " + offset;
}

}  // namespace

diagnostic_msgs::DiagnosticStatus watchStatus(const std::string& node, const WatchConfig& config,
                                              const WatchLook& look, double age_s) {
  DiagnosticStatus status;
  status.name = node + ": drift watch";
  status.hardware_id = "projector";
  if (look.problem.empty()) {
    judge(config, look.drift, status);
  } else {
    status.level = DiagnosticStatus::STALE;
    status.message = look.problem;
  }
  addValue(status, "seen", std::to_string(look.drift.seen.size()));
  addValue(status, "expected", std::to_string(look.drift.expected));
  if (!look.drift.seen.empty()) {
    addValue(status, "median_px", fixedText(look.drift.median_px, 2));
    addValue(status, "median_mm", fixedText(look.drift.median_mm, 2));
  }
  addValue(status, "limit", limitText(config));
  addValue(status, "age_s", fixedText(age_s, 1));
  for (const calib::TagDrift& tag : look.drift.seen) {
    addValue(status, "tag " + std::to_string(tag.id), offsetText(tag.px, tag.mm));
  }
  return status;
}

}  // namespace afterglow::nodes
