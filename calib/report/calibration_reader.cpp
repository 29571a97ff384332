
#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

#include "calib/number_text.hpp"
#include "calib/report/calibration_yaml.hpp"
#include "calib/yaml_source.hpp"

namespace afterglow::calib {
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
