#include "calib/report/calibration_yaml.hpp"

#include <cstdio>

#include "calib/number_text.hpp"

namespace afterglow::calib {

const ParameterName kParameterNames[kCalibrationParameters] = {
    {"fx", "px"},  {"fy", "px"},  {"cx", "px"},  {"cy", "px"}, {"k1", ""},  {"k2", ""},
    {"p1", ""},    {"p2", ""},    {"k3", ""},    {"k4", ""},   {"k5", ""},  {"k6", ""},
    {"wx", "rad"}, {"wy", "rad"}, {"wz", "rad"}, {"tx", "m"},  {"ty", "m"}, {"tz", "m"}};

namespace {

/// Double quotes take any text, and every YAML reader agrees on them.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') {
      result += '\\';
      result += letter;
    } else if (static_cast<unsigned char>(letter) < 0x20) {
      char code[8];
      std::snprintf(code, sizeof code, "\\x%02x", static_cast<unsigned>(letter));
      result += code;
    } else {
      result += letter;
    }
  }
  return result + '"';
}

template <typename Numbers>
std::string list(const Numbers& numbers, std::size_t count) {
  std::string text = "[";
  for (std::size_t i = 0; i < count; ++i) {
    text += (i > 0 ? ", " : "") + exactText(numbers[i]);
  }
  return text + "]";
}

template <typename Matrix>
std::string rowOf(const Matrix& matrix, int row) {
  std::string text = "[";
  for (int column = 0; column < matrix.cols(); ++column) {
    text += (column > 0 ? ", " : "") + exactText(matrix(row, column));
  }
  return text + "]";
}

template <typename Matrix>
std::string rows(const Matrix& matrix) {
  std::string text;
  for (int row = 0; row < matrix.rows(); ++row) text += "  - " + rowOf(matrix, row) + "\n";
  return text;
}

/// Row-major, in one list.
template <typename Matrix>
std::string flat(const Matrix& matrix) {
  std::string text = "[";
  for (int row = 0; row < matrix.rows(); ++row) {
    const std::string numbers = rowOf(matrix, row);
    text += (row > 0 ? ", " : "") + numbers.substr(1, numbers.size() - 2);
  }
  return text + "]";
}

std::string matrixBlock(const std::string& key, int row_count, int column_count,
                        const std::string& data) {
  return key + ":\n  rows: " + std::to_string(row_count) +
         "\n  cols: " + std::to_string(column_count) + "\n  data: " + data + "\n";
}

std::string lensBlock(const std::string& key, const Lens& lens) {
  return key + ":\n  width: " + std::to_string(lens.width) +
         "\n  height: " + std::to_string(lens.height) + "\n  K: " + flat(lens.K) +
         "\n  D: " + list(lens.D, lens.D.size()) +
         (lens.model == LensModel::Equidistant ? "\n  model: equidistant\n" : "\n");
}

std::string viewLine(const ViewResult& view) {
  std::string text = "  - {name: " + quoted(view.name) +
                     ", used: " + (view.is_used ? "true" : "false") +
                     ", training_rms_px: " + exactText(view.projected_rms_px);
  if (view.held_out_px) text += ", held_out_px: " + exactText(*view.held_out_px);
  if (view.held_out_mm) text += ", held_out_mm: " + exactText(*view.held_out_mm);
  if (!view.reason.empty()) text += ", reason: " + quoted(view.reason);
  return text + "}\n";
}

std::string parameterNames() {
  std::string text = "[";
  for (const ParameterName& parameter : kParameterNames) {
    text += (text.size() > 1 ? ", " : "") + std::string(parameter.name);
  }
  return text + "]";
}

bool isKnown(const Lens& lens) { return lens.width > 0; }

int viewsUsed(const Calibration& calibration) {
  int used = 0;
  for (const ViewResult& view : calibration.views) used += view.is_used ? 1 : 0;
  return used;
}

}  // namespace

std::string projectorYaml(const Lens& projector, const std::string& name) {
  const auto terms = static_cast<int>(distortionCoefficients(projector).size());
  Eigen::Matrix<double, 3, 4> P = Eigen::Matrix<double, 3, 4>::Zero();
  P.leftCols<3>() = projector.K;
  return "image_width: " + std::to_string(projector.width) +
         "\nimage_height: " + std::to_string(projector.height) + "\ncamera_name: " + quoted(name) +
         "\n" + matrixBlock("camera_matrix", 3, 3, flat(projector.K)) +
         "distortion_model: " + distortionModel(projector) + "\n" +
         matrixBlock("distortion_coefficients", 1, terms,
                     list(projector.D, static_cast<std::size_t>(terms))) +
         matrixBlock("rectification_matrix", 3, 3, flat(Eigen::Matrix3d::Identity().eval())) +
         matrixBlock("projection_matrix", 3, 4, flat(P));
}

std::string transformYaml(const Rigid<Camera, Projector>& T_camera_projector,
                          const CalibrationNames& names) {
  return "# p_camera = T_camera_projector * p_projector; optical frames (x right, y down, z "
         "forward), meters.\nparent_frame: " +
         quoted(names.camera_frame) + "\nchild_frame: " + quoted(names.projector_frame) +
         "\nT_camera_projector:\n" + rows(T_camera_projector.matrix().matrix());
}

std::string calibrationYaml(const Calibration& calibration, const CalibrationNames& names,
                            const std::string& date) {
  std::string text =
      "# The evidence behind projector.yaml and T_camera_projector.yaml. Pixels, meters, radians; "
      "errors in mm say so.\nformat: 1\ndate: " +
      quoted(date) + "\nprojector_name: " + quoted(names.projector_name) +
      "\nparent_frame: " + quoted(names.camera_frame) +
      "\nchild_frame: " + quoted(names.projector_frame) + "\n" +
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
      "\ntraining_rms_px: " + exactText(calibration.training_rms_px) +
      "\nboard_rms_px: " + exactText(calibration.board_rms_px) +
      "\ncoverage: " + exactText(calibration.coverage.share()) +
      "\nviews_used: " + std::to_string(viewsUsed(calibration)) +
      (calibration.views.empty() ? "\nviews: []\n" : "\nviews:\n");
  for (const ViewResult& view : calibration.views) text += viewLine(view);
  text += calibration.warnings.empty() ? "warnings: []\n" : "warnings:\n";
  for (const std::string& warning : calibration.warnings) text += "  - " + quoted(warning) + "\n";
  return text +
         "# w: rotation vector, T_camera_projector * exp(w); t: translation in the camera's "
         "frame.\nparameters: " +
         parameterNames() + "\ncovariance:\n" + rows(calibration.estimate.covariance);
}

}  // namespace afterglow::calib
