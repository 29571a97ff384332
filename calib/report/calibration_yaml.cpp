#include "calib/report/calibration_yaml.hpp"

#include <fmt/format.h>

#include "calib/number_text.hpp"

namespace afterglow::calib {

const ParameterName kParameterNames[kCalibrationParameters] = {
    {"fx", "px"},  {"fy", "px"},  {"cx", "px"},  {"cy", "px"}, {"k1", ""},  {"k2", ""},
    {"p1", ""},    {"p2", ""},    {"k3", ""},    {"k4", ""},   {"k5", ""},  {"k6", ""},
    {"wx", "rad"}, {"wy", "rad"}, {"wz", "rad"}, {"tx", "m"},  {"ty", "m"}, {"tz", "m"}};

namespace {

template <typename Matrix>
std::string rows(const Matrix& matrix) {
  std::string text;
  for (const std::string& row : yamlRows(matrix)) text += "  - " + row + "\n";
  return text;
}

/// So many of a lens's terms.
std::string terms(const Lens& lens, std::size_t count) {
  return yamlNumbers(Eigen::Map<const Eigen::RowVectorXd>(lens.D.data(), Eigen::Index(count)));
}

std::string matrixBlock(const std::string& key, int row_count, int column_count,
                        const std::string& data) {
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: {}\n", key, row_count, column_count,
                     data);
}

std::string lensBlock(const std::string& key, const Lens& lens) {
  return fmt::format("{}:\n  width: {}\n  height: {}\n  K: {}\n  D: {}\n{}", key, lens.width,
                     lens.height, yamlNumbers(lens.K), terms(lens, lens.D.size()),
                     lens.model == LensModel::Equidistant ? "  model: equidistant\n" : "");
}

std::string viewLine(const ViewResult& view) {
  std::string text = "  - {name: " + yamlText(view.name) +
                     ", used: " + (view.is_used ? "true" : "false") +
                     ", training_rms_px: " + exactText(view.projected_rms_px);
  if (view.held_out_px) text += ", held_out_px: " + exactText(*view.held_out_px);
  if (view.held_out_mm) text += ", held_out_mm: " + exactText(*view.held_out_mm);
  if (!view.reason.empty()) text += ", reason: " + yamlText(view.reason);
  return text + "}\n";
}

std::string parameterNames() {
  std::vector<const char*> names;
  for (const ParameterName& parameter : kParameterNames) names.push_back(parameter.name);
  return fmt::format("[{}]", fmt::join(names, ", "));
}

/// Formats the light's errors by distance in meters.
std::string lightMap(const Calibration& calibration) {
  std::vector<std::string> parts;
  for (const LightError& error : calibration.light) {
    parts.push_back(fmt::format("{:g}: {}", error.distance_m, exactText(error.mm)));
  }
  return fmt::format("{{{}}}", fmt::join(parts, ", "));
}

bool isKnown(const Lens& lens) { return lens.width > 0; }

int viewsUsed(const Calibration& calibration) {
  int used = 0;
  for (const ViewResult& view : calibration.views) used += view.is_used ? 1 : 0;
  return used;
}

}  // namespace

std::string projectorYaml(const Lens& projector, const std::string& name) {
  const auto count = distortionCoefficients(projector).size();
  Eigen::Matrix<double, 3, 4> P = Eigen::Matrix<double, 3, 4>::Zero();
  P.leftCols<3>() = projector.K;
  return "image_width: " + std::to_string(projector.width) +
         "\nimage_height: " + std::to_string(projector.height) +
         "\ncamera_name: " + yamlText(name) + "\n" +
         matrixBlock("camera_matrix", 3, 3, yamlNumbers(projector.K)) +
         "distortion_model: " + distortionModel(projector) + "\n" +
         matrixBlock("distortion_coefficients", 1, static_cast<int>(count),
                     terms(projector, count)) +
         matrixBlock("rectification_matrix", 3, 3, yamlNumbers(Eigen::Matrix3d::Identity())) +
         matrixBlock("projection_matrix", 3, 4, yamlNumbers(P));
}

std::string transformYaml(const Rigid<Camera, Projector>& T_camera_projector,
                          const CalibrationNames& names) {
  return "# p_camera = T_camera_projector * p_projector; optical frames (x right, y down, z "
         "forward), meters.\nparent_frame: " +
         yamlText(names.camera_frame) + "\nchild_frame: " + yamlText(names.projector_frame) +
         "\nT_camera_projector:\n" + rows(T_camera_projector.matrix().matrix());
}

std::string calibrationYaml(const Calibration& calibration, const CalibrationNames& names,
                            const std::string& date) {
  std::string text =
      "# The evidence behind projector.yaml and T_camera_projector.yaml. Pixels, meters, radians; "
      "errors in mm say so.\nformat: 1\ndate: " +
      yamlText(date) + "\nprojector_name: " + yamlText(names.projector_name) +
      "\nparent_frame: " + yamlText(names.camera_frame) +
      "\nchild_frame: " + yamlText(names.projector_frame) + "\n" +
      lensBlock("projector", calibration.estimate.projector) + "T_camera_projector:\n" +
      rows(calibration.estimate.T_camera_projector.matrix().matrix()) +
      lensBlock("camera", calibration.camera) + "# As it was given.\n" +
      lensBlock("camera_info",
                isKnown(calibration.camera_info) ? calibration.camera_info : calibration.camera) +
      "camera_fate: " + fateName(calibration.camera_change.fate) + "\n" +
      "# Root mean squares; held out: of each view against the calibration solved without it.\n"
      "held_out_rms_px: " +
      exactText(calibration.held_out_rms_px) +
      "\nheld_out_rms_mm: " + exactText(calibration.held_out_rms_mm) +
      "\npredicted_mm: " + exactText(calibration.predicted_mm) +
      "\n# 95 % of the light that the camera sees is closer to its place, with 95 % certainty.\n"
      "light_mm: " +
      lightMap(calibration) + "\n# Of calib/solver/board_shape.hpp.\nboard_shape: " +
      yamlNumbers(calibration.board_shape.parameters.transpose()) +
      "\ntraining_rms_px: " + exactText(calibration.training_rms_px) +
      "\nboard_rms_px: " + exactText(calibration.board_rms_px) +
      "\ncoverage: " + exactText(calibration.coverage.share()) +
      "\nviews_used: " + std::to_string(viewsUsed(calibration)) +
      (calibration.views.empty() ? "\nviews: []\n" : "\nviews:\n");
  for (const ViewResult& view : calibration.views) text += viewLine(view);
  text += calibration.warnings.empty() ? "warnings: []\n" : "warnings:\n";
  for (const std::string& warning : calibration.warnings) text += "  - " + yamlText(warning) + "\n";
  return text +
         "# w: rotation vector, T_camera_projector * exp(w); t: translation in the camera's "
         "frame.\nparameters: " +
         parameterNames() + "\ncovariance:\n" + rows(calibration.estimate.covariance);
}

}  // namespace afterglow::calib
