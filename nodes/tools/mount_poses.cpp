#include "nodes/tools/mount_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "calib/file_replacement.hpp"
#include "calib/number_text.hpp"
#include "calib/report/calibration_files.hpp"
#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kFarthestPose_m = 100;

/// 4 rows of 4 that are a rotation and a translation.
Eigen::Isometry3d readMatrix(const YamlMap& map, const std::string& key) {
  const YAML::Node rows = map.at(key);
  const std::string what = "'" + key + "' of " + map.where();
  Eigen::Isometry3d T;
  if (!rows.IsSequence() || rows.size() != 4) map.fail(rows, what + " should be 4 rows of 4");
  for (std::size_t row = 0; row < 4; ++row) {
    const auto numbers = map.numbers(rows[row], "a row of " + what, 4);
    for (std::size_t column = 0; column < 4; ++column) {
      T.matrix()(static_cast<int>(row), static_cast<int>(column)) = numbers[column];
    }
  }
  const Eigen::Matrix3d R = T.linear();
  const bool is_rotation =
      (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-4 &&
      R.determinant() > 0 && T.matrix().row(3) == Eigen::RowVector4d(0, 0, 0, 1);
  if (!is_rotation) map.fail(rows, what + " is not rigid: a rotation, a translation, 0 0 0 1");
  if (!(T.translation().norm() < kFarthestPose_m)) map.fail(rows, what + " should be in meters");
  return T;
}

void requireOneOf(const YamlMap& map, const std::string& a, const std::string& b) {
  if (map.has(a) == map.has(b)) {
    map.fail(map.node(), map.where() + " needs either '" + a + "' or '" + b + "'");
  }
}

/// Reads a transform as tf prints it, or as rows.
Eigen::Isometry3d readTransform(const YamlMap& map, const std::string& numbers,
                                const std::string& rows) {
  requireOneOf(map, numbers, rows);
  if (map.has(rows)) return readMatrix(map, rows);
  const YAML::Node node = map.at(numbers);
  const std::string what = "'" + numbers + "' of " + map.where();
  try {
    return poseFromNumbers(map.numbers(node, what, 7), what);
  } catch (const std::invalid_argument& error) {
    map.fail(node, error.what());
  }
}

void readTurret(const YamlMap& pose, MountRecord& record) {
  const YAML::Node joints = pose.at("turret");
  const std::string what = "'turret' of " + pose.where();
  if (!joints.IsSequence() || joints.size() == 0) {
    pose.fail(joints, what + " should be a list of joints, from the base on");
  }
  for (const YAML::Node& node : joints) {
    const YamlMap joint = pose.map(node, what, {"parent", "link", "tf", "T_parent_link"});
    if (record.links.empty()) record.links.push_back(joint.text("parent"));
    if (joint.text("parent") != record.links.back()) {
      joint.fail(node, what + ": a joint's parent is the link before, '" + record.links.back() +
                           "'");
    }
    record.links.push_back(joint.text("link"));
    record.T_parent_link.push_back(readTransform(joint, "tf", "T_parent_link"));
  }
}

MountRecord readRecord(const YamlMap& map, const std::string& path, std::size_t index) {
  MountRecord record;
  record.name = map.has("name") ? map.text("name") : "pose " + std::to_string(index + 1);
  requireOneOf(map, "calibration", "T_camera_projector");
  requireOneOf(map, "camera_tf", "T_link_camera");
  if (map.has("calibration")) {
    const auto folder = std::filesystem::path(path).parent_path() / map.text("calibration");
    record.T_camera_projector =
        calib::loadTCameraProjector((folder / "T_camera_projector.yaml").string());
  } else {
    record.T_camera_projector = Rigid<Camera, Projector>(readMatrix(map, "T_camera_projector"));
  }
  record.T_link_camera = Rigid<Link, Camera>(readTransform(map, "camera_tf", "T_link_camera"));
  if (map.has("turret")) readTurret(map, record);
  return record;
}

std::string rowsText(const Eigen::Isometry3d& T) {
  return fmt::format("[{}]", fmt::join(calib::yamlRows(T.matrix()), ", "));
}

std::string turretText(const MountRecord& record) {
  std::string text = record.links.empty() ? "" : "    turret:\n";
  for (std::size_t i = 0; i < record.T_parent_link.size(); ++i) {
    text += "      - {parent: " + calib::yamlText(record.links[i]) +
            ", link: " + calib::yamlText(record.links[i + 1]) +
            ", T_parent_link: " + rowsText(record.T_parent_link[i]) + "}\n";
  }
  return text;
}

}  // namespace

std::string cameraFrameOf(const std::string& calibration_folder) {
  const std::string path =
      (std::filesystem::path(calibration_folder) / "T_camera_projector.yaml").string();
  const YAML::Node file = loadYaml(path);
  const YAML::Node frame = file.IsMap() ? file["parent_frame"] : YAML::Node();
  if (frame.IsDefined() && frame.IsScalar() && !frame.Scalar().empty()) return frame.Scalar();
  throw std::runtime_error(path + " names no parent_frame: give --camera-frame");
}

std::vector<std::string> turretLinks(const std::vector<MountRecord>& records) {
  for (const MountRecord& record : records) {
    if (record.links == records.front().links) continue;
    throw std::runtime_error("poses " + records.front().name + " and " + record.name +
                             " are not of the same turret: take all with the same --turret");
  }
  return records.empty() ? std::vector<std::string>() : records.front().links;
}

Eigen::Isometry3d poseFromNumbers(const std::vector<double>& numbers, const std::string& what) {
  const bool is_finite = std::all_of(numbers.begin(), numbers.end(),
                                     [](double number) { return std::isfinite(number); });
  if (numbers.size() != 7 || !is_finite) {
    throw std::invalid_argument(what + " should be seven numbers: x y z qx qy qz qw");
  }
  Eigen::Quaterniond q(numbers[6], numbers[3], numbers[4], numbers[5]);
  if (!(std::abs(q.norm() - 1) < 0.01)) {
    throw std::invalid_argument(what + ": the quaternion qx qy qz qw has length " +
                                calib::fixedText(q.norm(), 3) +
                                ", expected 1 (x y z come first, w last)");
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = q.normalized().toRotationMatrix();
  T.translation() = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
  if (!(T.translation().norm() < kFarthestPose_m)) {
    throw std::invalid_argument(what + ": x y z should be in meters");
  }
  return T;
}

std::vector<MountRecord> loadMountRecords(const std::string& path) {
  const YamlMap root(path, loadYaml(path), "the list of poses", {"poses"});
  const YAML::Node poses = root.at("poses");
  if (!poses.IsSequence() || poses.size() == 0) {
    root.fail(poses, "'poses' should be a list of at least one pose");
  }
  std::vector<MountRecord> records;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const YamlMap map(path, poses[i], "pose " + std::to_string(i + 1),
                      {"name", "calibration", "T_camera_projector", "camera_tf", "T_link_camera",
                       "turret"});
    records.push_back(readRecord(map, path, i));
    const auto same = std::count_if(records.begin(), records.end(), [&](const auto& other) {
      return other.name == records.back().name;
    });
    if (same > 1) map.fail(map.node(), "two poses are called '" + records.back().name + "'");
  }
  return records;
}

void addMountRecord(const std::string& path, const MountRecord& record) {
  std::vector<MountRecord> records;
  if (std::filesystem::exists(path)) records = loadMountRecords(path);
  const auto same = std::find_if(records.begin(), records.end(),
                                 [&](const auto& other) { return other.name == record.name; });
  if (same != records.end()) {
    *same = record;
  } else {
    records.push_back(record);
  }
  std::string text = "# Poses for `afterglow calibrate mount --poses`.\nposes:\n";
  for (const MountRecord& each : records) {
    text += "  - name: " + calib::yamlText(each.name) +
            "\n    T_camera_projector: " + rowsText(each.T_camera_projector.matrix()) +
            "\n    T_link_camera: " + rowsText(each.T_link_camera.matrix()) + "\n" +
            turretText(each);
  }
  calib::replaceFile(path, text);
}

}  // namespace afterglow::nodes
