#include "calib/report/report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/number_text.hpp"
#include "calib/report/certainty.hpp"
#include "calib/report/parameters.hpp"
#include "calib/report/view_facts.hpp"

namespace afterglow::calib {
namespace {

using Json = nlohmann::ordered_json;

/// The distance from the projector of the points by which two calibrations are compared.
constexpr double kDriftDistance_m = 2;

Json orNull(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

std::string distortionText(const Lens& lens) {
  std::size_t terms = lens.D.size();
  while (terms > 0 && lens.D[terms - 1] == 0) --terms;
  std::string text = terms == 0 ? "none" : "";
  for (std::size_t i = 0; i < terms; ++i) text += (i > 0 ? ", " : "") + fixedText(lens.D[i], 5);
  return text;
}

Json lensData(const Lens& lens) {
  return {{"width", lens.width},
          {"height", lens.height},
          {"fx", lens.K(0, 0)},
          {"fy", lens.K(1, 1)},
          {"cx", lens.K(0, 2)},
          {"cy", lens.K(1, 2)},
          {"is_equidistant", lens.model == LensModel::Equidistant},
          {"distortion", distortionText(lens)}};
}

Json boardData(const Board& board) {
  Json data = {{"width_mm", 1000 * board.size_m.x()},
               {"height_mm", 1000 * board.size_m.y()},
               {"tags", board.tags.size()},
               {"family", board.family},
               {"tag_mm", nullptr}};
  if (!board.tags.empty()) {
    const Tag& tag = board.tags.front();
    data["tag_mm"] = 1000 * (tag.corners[1] - tag.corners[0]).norm();
  }
  return data;
}

void addOrigin(const Calibration& calibration, const ReportFacts& facts, Json& data) {
  data["projector_name"] = facts.names.projector_name;
  data["camera_frame"] = facts.names.camera_frame;
  data["projector_frame"] = facts.names.projector_frame;
  data["camera"] = lensData(calibration.camera);
  data["projector"] = lensData(calibration.estimate.projector);
  if (calibration.camera_info.width > 0) {
    data["camera_info"] = lensData(calibration.camera_info);
    data["camera_text"] = cameraText(calibration.camera_change);
  }
  if (facts.board) data["board"] = boardData(*facts.board);
  if (facts.pattern) {
    data["pattern"] = {{"width", facts.pattern->width},
                       {"height", facts.pattern->height},
                       {"tags", facts.pattern->tags.size()},
                       {"family", facts.pattern->family}};
  }
}

Json heldOut(const Calibration& calibration) {
  const auto count = std::count_if(
      calibration.views.begin(), calibration.views.end(),
      [](const ViewResult& view) { return view.is_used && view.held_out_px.has_value(); });
  if (count == 0) return nullptr;
  double nearest = 1e9, farthest = 0;
  for (const ViewResult& view : calibration.views) {
    if (!view.is_used || view.residuals.empty()) continue;
    const double distance = factsOf(view, calibration.estimate).distance_m;
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, distance);
  }
  return {{"rms_mm", calibration.held_out_rms_mm},
          {"rms_px", calibration.held_out_rms_px},
          {"view_count", count},
          {"nearest_m", nearest},
          {"farthest_m", farthest}};
}

/// The figures are those at 2 m, where the camera sees light there.
Json lightData(const Calibration& calibration) {
  if (calibration.light.empty()) return nullptr;
  const LightError& headline = calibration.light[calibration.light.size() > 1 ? 1 : 0];
  return {{"mm", headline.mm},
          {"px", headline.px},
          {"distance_m", headline.distance_m},
          {"text", lightText(calibration)}};
}

void addErrors(const Calibration& calibration, Json& data) {
  data["held_out"] = heldOut(calibration);
  data["training_rms_px"] = calibration.training_rms_px;
  data["board_rms_px"] = calibration.board_rms_px;
  data["predicted_mm"] = calibration.predicted_mm;
  data["light"] = lightData(calibration);
  data["board_text"] = shapeText(calibration.board_shape);
  data["is_camera_held"] = calibration.camera_change.fate == CameraFate::Held;
  data["used_count"] = usedViews(calibration);
  data["view_count"] = calibration.views.size();
  data["coverage"] = calibration.coverage.share();
}

/// A view that was left out is named once, not among the warnings, too.
bool isAboutLeftOut(const std::string& warning, const Calibration& calibration) {
  return std::any_of(calibration.views.begin(), calibration.views.end(),
                     [&](const ViewResult& view) {
                       return !view.is_used && warning.rfind(view.name + " left out", 0) == 0;
                     });
}

void addDoubts(const Calibration& calibration, Json& data) {
  data["left_out"] = Json::array();
  for (const ViewResult& view : calibration.views) {
    if (!view.is_used) data["left_out"].push_back({{"name", view.name}, {"reason", view.reason}});
  }
  data["warnings"] = Json::array();
  for (const std::string& warning : calibration.warnings) {
    if (!isAboutLeftOut(warning, calibration)) data["warnings"].push_back(warning);
  }
}

Json moved(const CalibrationRecord& before, const CalibrationRecord& after) {
  const auto shift = shiftBetween(before.estimate, after.estimate, kDriftDistance_m);
  if (!shift) return nullptr;
  return {{"px", shift->rms_px}, {"mm", shift->rms_mm}, {"largest_mm", shift->largest_mm}};
}

Json historyData(const Calibration& calibration, std::vector<CalibrationRecord> history,
                 const std::string& date) {
  if (!history.empty() && history.back().date == date) history.pop_back();  // saved already
  history.push_back({date, calibration.estimate, calibration.held_out_rms_px,
                     calibration.held_out_rms_mm, usedViews(calibration)});
  Json rows = Json::array();
  for (std::size_t i = 0; i < history.size(); ++i) {
    rows.push_back({{"date", history[i].date},
                    {"view_count", history[i].views_used},
                    {"held_out_px", history[i].held_out_rms_px},
                    {"held_out_mm", history[i].held_out_rms_mm},
                    {"moved", i > 0 ? moved(history[i - 1], history[i]) : Json()},
                    {"is_first", i == 0}});
  }
  return rows;
}

}  // namespace

Json viewData(const ViewResult& view, const ProjectorEstimate& estimate) {
  const auto projected =
      std::count_if(view.residuals.begin(), view.residuals.end(),
                    [](const CornerResidual& corner) { return corner.is_projected; });
  Json data = {{"name", view.name},
               {"is_used", view.is_used},
               {"reason", view.reason},
               {"printed", static_cast<std::ptrdiff_t>(view.residuals.size()) - projected},
               {"projected", projected}};
  if (!view.is_used) return data;
  const ViewFacts facts = factsOf(view, estimate);
  data["outliers"] = facts.outliers;
  data["distance_m"] = facts.distance_m;
  data["tilt_deg"] = facts.tilt_deg;
  data["turned"] = facts.turned;
  data["training_px"] = view.projected_rms_px;
  data["training_mm"] = orNull(facts.training_mm);
  data["held_out_px"] = orNull(view.held_out_px);
  data["held_out_mm"] = orNull(view.held_out_mm);
  return data;
}

Json reportData(const Calibration& calibration, const std::vector<CalibrationRecord>& history,
                const std::string& date, const ReportFacts& facts) {
  Json data = {{"date", date}};
  addOrigin(calibration, facts, data);
  addErrors(calibration, data);
  addDoubts(calibration, data);
  data["views"] = Json::array();
  for (const ViewResult& view : calibration.views) {
    data["views"].push_back(viewData(view, calibration.estimate));
  }
  addParameters(calibration.estimate, data);
  data["history"] = historyData(calibration, history, date);
  return data;
}

}  // namespace afterglow::calib
