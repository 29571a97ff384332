#include "calib/report/calibration_files.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "calib/camera_info_file.hpp"
#include "calib/file_replacement.hpp"
#include "calib/number_text.hpp"
#include "calib/yaml_source.hpp"

namespace afterglow::calib {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProjectorFile = "projector.yaml";
constexpr const char* kTransformFile = "T_camera_projector.yaml";
constexpr const char* kCameraFile = "camera.yaml";
constexpr const char* kCalibrationFile = "calibration.yaml";
constexpr const char* kHistoryFolder = "history";

std::string in(const std::string& folder, const std::string& name) {
  return (fs::path(folder) / name).string();
}

/// A solver gone wrong must not replace a calibration that works.
void checkFinite(const Calibration& calibration) {
  const ProjectorEstimate& estimate = calibration.estimate;
  if (!lensViolations(estimate.projector.width, estimate.projector.height, estimate.projector.K,
                      {estimate.projector.D.begin(), estimate.projector.D.end()})
           .empty() ||
      !estimate.T_camera_projector.matrix().matrix().allFinite() ||
      !estimate.covariance.allFinite() || !std::isfinite(calibration.held_out_rms_px) ||
      !std::isfinite(calibration.held_out_rms_mm)) {
    throw std::invalid_argument("saveCalibration: the calibration holds impossible numbers");
  }
}

bool isSameLens(const Lens& a, const Lens& b) {
  return a.K == b.K && a.D == b.D && a.width == b.width && a.height == b.height &&
         a.model == b.model;
}

/// A power cut between two renames, or an editor, can leave files of two calibrations side by side.
void checkOneCalibration(const std::string& folder, const ProjectorEstimate& files,
                         const ProjectorEstimate& record) {
  const bool same_lens = isSameLens(files.projector, record.projector);
  const bool same_pose =
      files.T_camera_projector.matrix().matrix() == record.T_camera_projector.matrix().matrix();
  if (same_lens && same_pose) return;
  throw std::runtime_error(
      in(folder, same_lens ? kTransformFile : kProjectorFile) +
      ": is not of the same calibration as calibration.yaml beside it; copy the three files of one "
      "calibration here, or remove calibration.yaml to go without its uncertainty");
}

}  // namespace

void saveCalibration(const std::string& folder, const Calibration& calibration,
                     const CalibrationNames& names, const std::string& date) {
  if (!isDate(date)) {
    throw std::invalid_argument("saveCalibration: date is \"" + date +
                                "\", expected UTC as 2026-11-21T04:30:00Z");
  }
  checkFinite(calibration);
  const std::string evidence = calibrationYaml(calibration, names, date);
  FileReplacement replacement;
  replacement.add(in(folder, kProjectorFile),
                  projectorYaml(calibration.estimate.projector, names.projector_name));
  replacement.add(in(folder, kTransformFile),
                  transformYaml(calibration.estimate.T_camera_projector, names));
  replacement.add(in(folder, kCameraFile), projectorYaml(calibration.camera, names.camera_name));
  replacement.add(in(in(folder, kHistoryFolder), date + ".yaml"), evidence);
  replacement.add(in(folder, kCalibrationFile), evidence);
  replacement.commit();
}

ProjectorEstimate loadCalibration(const std::string& folder) {
  const std::string projector_path = in(folder, kProjectorFile);
  const CameraInfoFile projector = loadCameraInfo(projector_path);
  if (!projector.warning.empty()) {
    throw std::runtime_error(projector_path + ": " + projector.warning +
                             "; a projector's picture is not rectified, so they must be equal");
  }
  ProjectorEstimate estimate;
  estimate.projector = projector.lens;
  estimate.T_camera_projector = loadTCameraProjector(in(folder, kTransformFile));
  const std::string calibration_path = in(folder, kCalibrationFile);
  if (fs::exists(calibration_path)) {
    const CalibrationRecord record = loadRecord(calibration_path);
    checkOneCalibration(folder, estimate, record.estimate);
    estimate.covariance = record.estimate.covariance;
  }
  return estimate;
}

Lens cameraOf(const std::string& folder, const std::optional<Lens>& given) {
  const std::string path = in(folder, kCalibrationFile);
  std::optional<CalibrationRecord> record;
  if (fs::exists(path)) record = loadRecord(path);
  if (!record || !record->camera) {
    if (given) return *given;
    throw std::runtime_error(path + ": does not say which camera it was made with: give --camera");
  }
  const bool is_of_calibration =
      !given || (record->camera_info && isSameLens(*given, *record->camera_info));
  return is_of_calibration ? *record->camera : *given;
}

std::vector<CalibrationRecord> calibrationHistory(const std::string& folder,
                                                  std::vector<std::string>& problems) {
  const std::string history = in(folder, kHistoryFolder);
  std::vector<CalibrationRecord> records;
  std::error_code error;
  if (!fs::exists(history, error)) return records;
  std::vector<std::string> paths;
  for (fs::directory_iterator entry(history, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    const bool is_hidden = path.filename().string().front() == '.';
    if (path.extension() == ".yaml" && !is_hidden) paths.push_back(path.string());
  }
  if (error) problems.push_back(history + ": cannot be read: " + error.message());
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) {
    try {
      records.push_back(loadRecord(path));
    } catch (const std::runtime_error& problem) {
      problems.push_back(problem.what());
    }
  }
  std::stable_sort(records.begin(), records.end(),
                   [](const auto& a, const auto& b) { return a.date < b.date; });
  return records;
}

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

namespace {

/// A file's map, whose getters refuse with file, line, key and value.
class Record {
 public:
  explicit Record(const std::string& path) : path_(path), root_(loadYamlValues(path)) {
    if (!root_.IsMap()) refuse("holds no keys; expected what `afterglow calibrate` writes");
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw std::runtime_error(path_ + ": " + what);
  }
  [[noreturn]] void refuse(const std::string& key, const YAML::Node& node,
                           const std::string& expected) const {
    refuse(yamlMisfit(key, node, "expected " + expected, "a list or a map"));
  }

  YAML::Node at(const YAML::Node& map, const std::string& key) const {
    const YAML::Node node = map.IsMap() ? map[key] : YAML::Node(YAML::NodeType::Undefined);
    if (!node || node.IsNull()) refuse(key + ": missing");
    return node;
  }
  YAML::Node at(const std::string& key) const { return at(root_, key); }

  double number(const std::string& key, const YAML::Node& node) const {
    const std::optional<double> value =
        node.IsScalar() ? numberFromText(node.Scalar()) : std::nullopt;
    if (!value) refuse(key, node, "a finite number");
    return *value;
  }
  /// A whole number of at least `least`.
  int whole(const YAML::Node& map, const std::string& key, int least) const {
    const YAML::Node node = at(map, key);
    const double value = number(key, node);
    if (value != std::floor(value) || value < least || value > 1e6) {
      refuse(key, node, "a whole number from " + std::to_string(least));
    }
    return static_cast<int>(value);
  }
  std::string text(const std::string& key) const {
    const YAML::Node node = at(key);
    if (!node.IsScalar()) refuse(key, node, "a text");
    return node.Scalar();
  }
  std::vector<double> numbers(const std::string& key, const YAML::Node& node,
                              std::size_t count) const {
    if (!node.IsSequence()) refuse(key, node, "a list of numbers");
    std::vector<double> values;
    for (const YAML::Node& item : node) {
      if (item.IsSequence()) {
        for (const YAML::Node& inner : item) values.push_back(number(key, inner));
      } else {
        values.push_back(number(key, item));
      }
    }
    if (values.size() != count) {
      refuse(key + ": expected " + std::to_string(count) + " numbers, found " +
             std::to_string(values.size()));
    }
    return values;
  }
  /// Rows of `columns`, or all of it in one list, row-major.
  Eigen::MatrixXd matrix(const std::string& key, int row_count, int column_count) const {
    const YAML::Node node = at(key);
    const std::vector<double> values =
        numbers(key, node, static_cast<std::size_t>(row_count * column_count));
    if (node.size() > 0 && node[0].IsSequence()) {
      for (const YAML::Node& row : node) {
        if (!row.IsSequence() || row.size() != static_cast<std::size_t>(column_count)) {
          refuse(key + ": expected " + std::to_string(row_count) + " rows of " +
                 std::to_string(column_count) + " numbers");
        }
      }
    }
    return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        values.data(), row_count, column_count);
  }
  Lens lens(const std::string& key) const {
    const YAML::Node node = at(key);
    const int width = whole(node, "width", 1), height = whole(node, "height", 1);
    const std::vector<double> k = numbers(key + ": K", at(node, "K"), 9);
    std::vector<double> D = numbers(key + ": D", at(node, "D"), 8);
    const bool is_fisheye = node["model"] && node["model"].Scalar() == "equidistant";
    if (is_fisheye) D.resize(4);
    Eigen::Matrix3d K;
    K << k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8];
    try {
      return makeLens(width, height, K, D,
                      is_fisheye ? LensModel::Equidistant : LensModel::BrownConrady);
    } catch (const std::invalid_argument& error) {
      refuse(key + ": " + error.what());
    }
  }
  std::optional<Lens> lensIfThere(const std::string& key) const {
    if (!root_[key]) return std::nullopt;
    return lens(key);
  }
  Rigid<Camera, Projector> rigid(const std::string& key) const;
  double notNegative(const std::string& key) const {
    const YAML::Node node = at(key);
    const double value = number(key, node);
    if (value < 0) refuse(key, node, "a number from 0");
    return value;
  }

 private:
  std::string path_;
  YAML::Node root_;
};

Rigid<Camera, Projector> Record::rigid(const std::string& key) const {
  // Six decimals typed by hand still pass; a scaled or sheared matrix does not.
  constexpr double kTolerance = 1e-5;
  constexpr double kFarthest = 50;
  Eigen::Isometry3d T;
  T.matrix() = matrix(key, 4, 4);
  const Eigen::Matrix3d R = T.linear();
  if (!(T.matrix().row(3) == Eigen::RowVector4d(0, 0, 0, 1))) {
    refuse(key + ": the last row must be 0 0 0 1");
  }
  if (!((R.transpose() * R - Eigen::Matrix3d::Identity()).array().abs() < kTolerance).all()) {
    refuse(key +
           ": is not rigid: its upper left 3 x 3 is no rotation (rows must be perpendicular "
           "and of length 1)");
  }
  if (R.determinant() < 0) refuse(key + ": is not rigid: it mirrors (determinant -1)");
  if (T.translation().norm() > kFarthest) {
    refuse(key + ": camera and projector are " + fixedText(T.translation().norm(), 1) +
           " m apart; expected meters, not millimeters");
  }
  return Rigid<Camera, Projector>(T);
}

using Covariance = Eigen::Matrix<double, kCalibrationParameters, kCalibrationParameters>;

Covariance covarianceOf(const Record& record) {
  const Covariance covariance =
      record.matrix("covariance", kCalibrationParameters, kCalibrationParameters);
  const double largest = covariance.cwiseAbs().maxCoeff();
  if (!((covariance - covariance.transpose()).array().abs() <= 1e-9 * largest).all() ||
      covariance.diagonal().minCoeff() < 0) {
    record.refuse("covariance: expected a symmetric matrix with no negative variance");
  }
  return covariance;
}

}  // namespace

bool isDate(const std::string& text) {
  const std::string form = "0000-00-00T00:00:00Z";
  return text.size() == form.size() &&
         std::equal(text.begin(), text.end(), form.begin(), [](char letter, char expected) {
           return expected == '0' ? letter >= '0' && letter <= '9' : letter == expected;
         });
}

Rigid<Camera, Projector> loadTCameraProjector(const std::string& path) {
  return Record(path).rigid("T_camera_projector");
}

CalibrationRecord loadRecord(const std::string& path) {
  const Record file(path);
  if (file.text("format") != "1") {
    file.refuse("format: is " + file.text("format") + "; this version reads 1");
  }
  CalibrationRecord record;
  record.date = file.text("date");
  if (!isDate(record.date)) {
    file.refuse("date: is \"" + record.date + "\", expected UTC as 2026-11-21T04:30:00Z");
  }
  record.estimate.projector = file.lens("projector");
  record.estimate.T_camera_projector = file.rigid("T_camera_projector");
  record.estimate.covariance = covarianceOf(file);
  record.held_out_rms_px = file.notNegative("held_out_rms_px");
  record.held_out_rms_mm = file.notNegative("held_out_rms_mm");
  const double used = file.notNegative("views_used");
  record.camera = file.lensIfThere("camera");
  record.camera_info = file.lensIfThere("camera_info");
  record.views_used = static_cast<int>(std::min(used, 1e6));
  return record;
}

}  // namespace afterglow::calib
