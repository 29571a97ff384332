#include "calib/camera_info_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include "calib/lens.hpp"
#include "calib/number_text.hpp"
#include "calib/yaml_source.hpp"

namespace afterglow::calib {
namespace {

/// The keys of the two forms.
struct Keys {
  std::string width, height, K, model, D, P;
};
const Keys kParsersForm{"image_width",
                        "image_height",
                        "camera_matrix",
                        "distortion_model",
                        "distortion_coefficients",
                        "projection_matrix"};
const Keys kMessageForm{"width", "height", "K", "distortion_model", "D", "P"};

/// Collects all violations while reading, so that they are reported together.
class Reader {
 public:
  Reader(const YAML::Node& root, std::vector<std::string>& violations)
      : root_(root), violations_(violations) {}

  int integer(const std::string& key) {
    const YAML::Node node = root_[key];
    if (!node) {
      violations_.push_back(key + ": missing");
      return 0;
    }
    int value = 0;
    if (!YAML::convert<int>::decode(node, value)) {
      complain(key, node, "expected a whole number");
    } else if (value <= 0) {
      complain(key, node, "expected at least 1");
    }
    return value;
  }

  /// A list of numbers, either bare or the `data` of a matrix.
  std::vector<double> numbers(const std::string& key, std::optional<std::size_t> count) {
    const YAML::Node list = listAt(key);
    std::vector<double> values;
    if (!list) return values;
    for (const YAML::Node& item : list) {
      const std::optional<double> value =
          item.IsScalar() ? numberFromText(item.Scalar()) : std::nullopt;
      if (!value) complain(key, item, "expected a finite number");
      values.push_back(value.value_or(0));
    }
    if (count && values.size() != *count) {
      violations_.push_back(key + ": expected " + std::to_string(*count) + " numbers, found " +
                            std::to_string(values.size()));
      values.clear();
    }
    return values;
  }

  std::string text(const std::string& key) {
    const YAML::Node node = root_[key];
    return node && node.IsScalar() ? node.Scalar() : "";
  }

 private:
  YAML::Node listAt(const std::string& key) {
    YAML::Node node = root_[key];
    if (!node) {
      violations_.push_back(key + ": missing");
      return YAML::Node(YAML::NodeType::Undefined);
    }
    if (node.IsMap()) node.reset(node["data"]);
    if (!node || !node.IsSequence()) {
      violations_.push_back(key + ": expected a list of numbers");
      return YAML::Node(YAML::NodeType::Undefined);
    }
    return node;
  }

  void complain(const std::string& key, const YAML::Node& node, const std::string& expected) {
    violations_.push_back(yamlMisfit(key, node, expected, "no scalar"));
  }

  YAML::Node root_;
  std::vector<std::string>& violations_;
};

/// The numbers of D that the model has; without a model all must be zero, and none is used.
std::vector<double> readDistortion(const Keys& keys, const std::string& model,
                                   const std::vector<double>& D,
                                   std::vector<std::string>& violations) {
  if (model.empty()) {
    if (std::any_of(D.begin(), D.end(), [](double d) { return d != 0; })) {
      violations.push_back(keys.model + ": missing, but " + keys.D + " is not zero");
    }
    return {};
  }
  if (!lensModelNamed(model)) {
    violations.push_back(
        keys.model + ": \"" + model +
        "\" is not supported; expected plumb_bob, rational_polynomial or equidistant");
  }
  try {
    return usedDistortion(model, D);
  } catch (const std::invalid_argument& error) {
    violations.push_back(keys.D + ": " + error.what());
    return {};
  }
}

/// A pixel counts as a disagreement from 0.5 px on: rectification alone may shift P a little.
std::string compareWithP(const Eigen::Matrix3d& K, const std::vector<double>& P) {
  if (P.size() != 12 || P[0] == 0) return "";
  const struct {
    const char* name;
    double k, p;
  } pairs[] = {
      {"fx", K(0, 0), P[0]}, {"fy", K(1, 1), P[5]}, {"cx", K(0, 2), P[2]}, {"cy", K(1, 2), P[6]}};
  std::vector<std::string> differences;
  for (const auto& pair : pairs) {
    if (std::abs(pair.k - pair.p) < 0.5) continue;
    differences.push_back(fmt::format("{} {:g} against {:g}", pair.name, pair.k, pair.p));
  }
  if (differences.empty()) return "";
  return fmt::format("K and P disagree ({} px): K is used, P is for rectified images only",
                     fmt::join(differences, ", "));
}

[[noreturn]] void refuse(const std::string& path, const std::vector<std::string>& violations) {
  throw std::runtime_error(fmt::format("{}: {}", path, fmt::join(violations, "; ")));
}

YAML::Node loadMap(const std::string& path) {
  YAML::Node root = loadYamlValues(path);
  if (!root.IsMap()) refuse(path, {"is not a camera_info file: expected camera_matrix or K"});
  return root;
}

std::string nameOf(const YAML::Node& root) {
  const YAML::Node name = root["camera_name"];
  if (name && name.IsScalar()) return name.Scalar();
  const YAML::Node header = root["header"];
  if (header && header.IsMap() && header["frame_id"] && header["frame_id"].IsScalar()) {
    return header["frame_id"].Scalar();
  }
  return "";
}

}  // namespace

CameraInfoFile loadCameraInfo(const std::string& path) {
  const YAML::Node root = loadMap(path);
  if (!root["camera_matrix"] && !root["K"]) {
    refuse(path, {"is not a camera_info file: expected camera_matrix or K"});
  }
  const Keys& keys = root["camera_matrix"] ? kParsersForm : kMessageForm;
  std::vector<std::string> violations;
  Reader reader(root, violations);
  const int width = reader.integer(keys.width), height = reader.integer(keys.height);
  const std::vector<double> k = reader.numbers(keys.K, 9);
  const std::string model_name = reader.text(keys.model);
  const std::vector<double> D = readDistortion(
      keys, model_name, reader.numbers(keys.D, std::nullopt), violations);
  std::vector<std::string> of_no_use;  // P is compared where it can be, and never used
  const std::vector<double> P = Reader(root, of_no_use).numbers(keys.P, 12);
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  if (k.size() == 9) K << k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8];
  if (k.size() == 9 && K.isZero(0)) {
    // Drivers of uncalibrated cameras send this.
    violations.push_back(keys.K +
                         ": is all zero: this camera is not calibrated; calibrate it first");
  } else {
    // D has been checked above, and a size below 1, with their keys.
    const auto atLeastOne = [](int side) { return std::max(side, 1); };
    for (const std::string& violation :
         lensViolations(atLeastOne(width), atLeastOne(height), K, {})) {
      violations.push_back(keys.K + ": " + violation);
    }
  }
  if (!violations.empty()) refuse(path, violations);
  const LensModel model = lensModelNamed(model_name).value_or(LensModel::BrownConrady);
  return {makeLens(width, height, K, D, model), nameOf(root), compareWithP(K, P)};
}

}  // namespace afterglow::calib
