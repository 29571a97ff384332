#include "calib/report/report.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "calib/number_text.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {
namespace {

using Json = nlohmann::ordered_json;

struct ViewFacts {
  double distance_m = 0;  ///< distance from the projector's lens to the board's middle
  double tilt_deg = 0;    ///< angle between the board's normal and the projector's axis
  std::string turned;     ///< the direction of the board's face, seen from the projector: an arrow
  int outliers = 0;       ///< corners
  std::optional<double> training_mm;  ///< projected_rms_px as millimeters on the board
};

/// Below this a board faces the projector: the direction of its tilt means nothing.
constexpr double kFacing_deg = 3;

std::string arrow(const Eigen::Vector3d& n_projector) {
  static const char* const kArrows[] = {"→", "↘", "↓", "↙", "←", "↖", "↑", "↗"};
  const double turns = std::atan2(n_projector.y(), n_projector.x()) * kDegrees / 45;
  return kArrows[(static_cast<int>(std::lround(turns)) + 8) % 8];
}

struct Plane {
  Eigen::Vector3d p_projector, n_projector;
};

std::optional<Eigen::Vector3d> hit(const Lens& projector, const Eigen::Vector2d& pixel,
                                   const Plane& plane) {
  const auto ray = unproject(projector, pixel);
  if (!ray) return std::nullopt;
  const double scale = plane.n_projector.dot(plane.p_projector) / plane.n_projector.dot(*ray);
  if (!std::isfinite(scale)) return std::nullopt;
  return (*ray * scale).eval();
}

/// Root mean squares' ratio over the view's projected corners.
std::optional<double> mmPerPixel(const ViewResult& view, const Lens& projector,
                                 const Plane& board) {
  double mm2 = 0, px2 = 0;
  for (const CornerResidual& corner : view.residuals) {
    if (!corner.is_projected || corner.is_outlier) continue;
    const auto expected = hit(projector, corner.pattern_px, board);
    const auto seen = hit(projector, corner.pattern_px + corner.pattern_error_px, board);
    if (!expected || !seen) continue;
    mm2 += 1e6 * (*seen - *expected).squaredNorm();
    px2 += corner.pattern_error_px.squaredNorm();
  }
  if (!(px2 > 0)) return std::nullopt;
  return std::sqrt(mm2 / px2);
}

/// Returns the facts of a view with a pose (one that has residuals).
ViewFacts factsOf(const ViewResult& view, const ProjectorEstimate& estimate) {
  ViewFacts facts;
  const Rigid<Projector, Surface> T_projector_board =
      estimate.T_camera_projector.inverse() * view.T_camera_board;
  const Plane board{T_projector_board.matrix().translation(),
                    T_projector_board.matrix().linear().col(2)};
  facts.distance_m = board.p_projector.norm();
  facts.tilt_deg = std::acos(std::clamp(-board.n_projector.z(), -1.0, 1.0)) * kDegrees;
  if (facts.tilt_deg >= kFacing_deg) facts.turned = arrow(board.n_projector);
  for (const CornerResidual& corner : view.residuals) {
    facts.outliers += corner.is_outlier ? 1 : 0;
  }
  const auto scale = mmPerPixel(view, estimate.projector, board);
  if (scale) facts.training_mm = view.projected_rms_px * *scale;
  return facts;
}

int usedViews(const Calibration& calibration) {
  return static_cast<int>(std::count_if(calibration.views.begin(), calibration.views.end(),
                                        [](const ViewResult& view) { return view.is_used; }));
}

constexpr int kLensTerms = 4, kRotation = 12, kTranslation = 15;

/// So many decimals that the deviation has two digits.
int decimalsFor(double deviation) {
  if (!(deviation > 0)) return 3;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(deviation))), 0, 9);
}

/// A hyphen is too short to be seen before a number.
std::string withMinus(const std::string& number) {
  return number.rfind('-', 0) == 0 ? "−" + number.substr(1) : number;
}

Json row(const std::string& name, double value, double deviation, const std::string& unit,
         const std::string& meaning) {
  const int decimals = decimalsFor(deviation);
  const std::string after = unit.empty() || unit == "°" ? unit : " " + unit;
  const bool is_held = deviation == 0;
  return {{"name", name},
          {"value", is_held && value == 0 ? "0" : withMinus(fixedText(value, decimals)) + after},
          {"deviation", is_held ? Json() : Json("± " + fixedText(deviation, decimals) + after)},
          {"meaning", meaning}};
}

class Parameters {
 public:
  explicit Parameters(const ProjectorEstimate& estimate) : estimate_(estimate) {}

  double deviation(int index) const {
    return std::sqrt(std::max(0.0, estimate_.covariance(index, index)));
  }
  /// Returns the correlation, between -1 and 1; 0 if either is held fixed.
  double correlation(int a, int b) const {
    const double product = deviation(a) * deviation(b);
    return product > 0 ? estimate_.covariance(a, b) / product : 0;
  }

  Json lensRows() const {
    const Eigen::Matrix3d& K = estimate_.projector.K;
    Json rows = Json::array({row("fx", K(0, 0), deviation(0), "px", "focal length across"),
                             row("fy", K(1, 1), deviation(1), "px", "focal length down"),
                             row("cx", K(0, 2), deviation(2), "px", "principal point across"),
                             row("cy", K(1, 2), deviation(3), "px", "principal point down")});
    static constexpr const char* kMeanings[] = {"radial, r²",
                                                "radial, r⁴",
                                                "tangential",
                                                "tangential",
                                                "radial, r⁶",
                                                "radial, r² of the divisor",
                                                "radial, r⁴ of the divisor",
                                                "radial, r⁶ of the divisor"};
    for (int i = 0; i < 8; ++i) {
      const double value = estimate_.projector.D[static_cast<std::size_t>(i)];
      const double sigma = deviation(kLensTerms + i);
      if (i > 4 && value == 0 && sigma == 0) continue;  // plumb_bob has no divisor
      rows.push_back(row(kParameterNames[kLensTerms + i].name, value, sigma, "", kMeanings[i]));
    }
    return rows;
  }

  Json poseRows() const {
    const Eigen::Isometry3d& T = estimate_.T_camera_projector.matrix();
    const Eigen::AngleAxisd turn(T.linear());
    const Eigen::Vector3d w = turn.angle() * turn.axis();
    Json rows = Json::array();
    static constexpr const char* kAxes[] = {"x", "y", "z"};
    static constexpr const char* kPlaces[] = {"to the camera’s right", "down", "forward"};
    for (int i = 0; i < 3; ++i) {
      rows.push_back(row(std::string("t") + kAxes[i], 1000 * T.translation()[i],
                         1000 * deviation(kTranslation + i), "mm",
                         std::string("where the projector’s lens is, ") + kPlaces[i]));
    }
    for (int i = 0; i < 3; ++i) {
      rows.push_back(row(std::string("w") + kAxes[i], kDegrees * w[i],
                         kDegrees * deviation(kRotation + i), "°",
                         std::string("rotation vector, about ") + kAxes[i]));
    }
    return rows;
  }

 private:
  const ProjectorEstimate& estimate_;
};

/// Returns the facts that a projector's buyer asks for.
Json lensFacts(const Lens& lens) {
  const double shift = (lens.K(1, 2) - 0.5 * (lens.height - 1)) / lens.height;
  const auto low = unproject(lens, {-0.5, 0.5 * (lens.height - 1)});
  const auto high = unproject(lens, {lens.width - 0.5, 0.5 * (lens.height - 1)});
  Json data = {{"throw_ratio", lens.K(0, 0) / lens.width},
               {"wide_deg", nullptr},
               {"shift", std::abs(shift)},
               {"shift_side", shift > 0 ? "below" : "above"},
               {"pixel_mm", 1000 / lens.K(0, 0)}};
  if (low && high) {
    data["wide_deg"] = kDegrees * std::atan2(low->cross(*high).norm(), low->dot(*high));
  }
  return data;
}

/// Returns how principal point and rotation trade off against each other; null if either is held
/// fixed.
Json tradeOff(const Parameters& parameters) {
  const double across = parameters.correlation(2, kRotation + 1);
  const double down = parameters.correlation(3, kRotation);
  if (across == 0 && down == 0) return nullptr;
  return {{"across", withMinus(fixedText(across, 3))}, {"down", withMinus(fixedText(down, 3))}};
}

/// Adds lens and pose of reportData. Values and deviations are texts with their unit: so many
/// decimals that the deviation has two digits.
void addParameters(const ProjectorEstimate& estimate, Json& data) {
  const Parameters parameters(estimate);
  data["lens"] = lensFacts(estimate.projector);
  data["lens"]["parameters"] = parameters.lensRows();
  data["pose"] = {{"apart_mm", 1000 * estimate.T_camera_projector.matrix().translation().norm()},
                  {"parameters", parameters.poseRows()},
                  {"trade_off", tradeOff(parameters)}};
}

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

namespace {

/// 95 % of a two-dimensional normal distribution lies within chi^2 = -2 ln 0.05.
const double kChi95 = std::sqrt(-2 * std::log(0.05));

double longestHalfAxis(const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance, Eigen::EigenvaluesOnly);
  return kChi95 * std::sqrt(std::max(0.0, eigen.eigenvalues().maxCoeff()));
}

/// Meters on the plane z = distance for a pixel's step, by central differences over one pixel.
std::optional<Eigen::Matrix2d> metersPerPixel(const Lens& lens, const Eigen::Vector2d& pixel,
                                              double distance_m) {
  Eigen::Matrix2d J;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d half = 0.5 * Eigen::Vector2d::Unit(axis);
    const auto ahead = unproject(lens, pixel + half), behind = unproject(lens, pixel - half);
    if (!ahead || !behind) return std::nullopt;
    J.col(axis) = (*ahead - *behind).head<2>() * distance_m;
  }
  return J;
}

}  // namespace

std::optional<Uncertainty> uncertaintyAt(const ProjectorEstimate& estimate,
                                         const Eigen::Vector2d& pixel, double distance_m) {
  const auto ray = unproject(estimate.projector, pixel);
  const auto J = metersPerPixel(estimate.projector, pixel, distance_m);
  if (!ray || !J) return std::nullopt;
  const auto predicted = predictPixel(estimate, estimate.T_camera_projector * (*ray * distance_m));
  if (!predicted || !predicted->covariance.allFinite()) return std::nullopt;
  return Uncertainty{longestHalfAxis(predicted->covariance),
                     1000 * longestHalfAxis(*J * predicted->covariance * J->transpose())};
}

UncertaintyGrid uncertaintyGrid(const ProjectorEstimate& estimate, double distance_m) {
  UncertaintyGrid grid;
  grid.columns = 4 * Coverage::kColumns;
  grid.rows = 4 * Coverage::kRows;
  grid.distance_m = distance_m;
  grid.cell_px = Eigen::Vector2d(double(estimate.projector.width) / grid.columns,
                                 double(estimate.projector.height) / grid.rows);
  for (int i = 0; i < grid.columns * grid.rows; ++i) {
    const Eigen::Vector2d center(i % grid.columns + 0.5, i / grid.columns + 0.5);
    grid.cells.push_back(uncertaintyAt(
        estimate, grid.cell_px.cwiseProduct(center) - Eigen::Vector2d(0.5, 0.5), distance_m));
  }
  return grid;
}

std::optional<LightShift> shiftBetween(const ProjectorEstimate& before,
                                       const ProjectorEstimate& after, double distance_m) {
  constexpr int kSteps = 8;
  const Lens& lens = before.projector;
  if (lens.width != after.projector.width || lens.height != after.projector.height) return {};
  const Rigid<Projector, Camera> T_after_camera = after.T_camera_projector.inverse();
  LightShift shift;
  int count = 0;
  for (int i = 0; i <= kSteps * kSteps + 2 * kSteps; ++i) {
    const Eigen::Vector2d share(i % (kSteps + 1), i / (kSteps + 1));
    const Eigen::Vector2d pixel =
        share.cwiseProduct(Eigen::Vector2d(lens.width - 1, lens.height - 1)) / kSteps;
    const auto ray = unproject(lens, pixel);
    const auto J = metersPerPixel(lens, pixel, distance_m);
    if (!ray || !J) continue;
    const auto now = project(after.projector,
                             T_after_camera * (before.T_camera_projector * (*ray * distance_m)));
    if (!now) continue;
    const double mm = 1000 * (*J * (*now - pixel)).norm();
    shift.rms_px += (*now - pixel).squaredNorm();
    shift.rms_mm += mm * mm;
    shift.largest_mm = std::max(shift.largest_mm, mm);
    ++count;
  }
  if (count == 0) return std::nullopt;
  shift.rms_px = std::sqrt(shift.rms_px / count);
  shift.rms_mm = std::sqrt(shift.rms_mm / count);
  return shift;
}

}  // namespace afterglow::calib
