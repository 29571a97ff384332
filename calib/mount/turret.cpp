#include "calib/mount/turret.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "calib/number_text.hpp"
#include "calib/yaml_source.hpp"

namespace afterglow::calib {
namespace {

std::string poseText(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(T.linear()).normalized();
  return fmt::format("{{translation: {}, rotation: {}}}", yamlNumbers(T.translation()),
                     yamlNumbers(q.coeffs()));
}

std::string jointText(const TurretJoint& joint) {
  return fmt::format(
      "  - parent: {}\n    link: {}\n    correction: {}\n    axis: {}\n    middle: {}\n"
      "    scale: {}\n",
      joint.parent, joint.link, poseText(joint.correction), yamlNumbers(joint.axis),
      yamlNumbers(joint.R_parent_middle.coeffs()), exactText(joint.scale));
}

/// Names come from people's files.
std::string oneLine(std::string text) {
  for (char& letter : text) {
    if (static_cast<unsigned char>(letter) < 0x20 || letter == 0x7f) letter = ' ';
  }
  return text;
}

Eigen::Quaterniond readRotation(const YamlSource& file, const YAML::Node& node,
                                const std::string& what) {
  const std::vector<double> q = file.numbers(node, what, 4);
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(rotation.norm() - 1) > 1e-3) file.refuse(node, what + " should have length 1");
  return rotation.normalized();
}

Eigen::Vector3d readVector(const YamlSource& file, const YAML::Node& node,
                           const std::string& what) {
  const std::vector<double> v = file.numbers(node, what, 3);
  if (!(Eigen::Vector3d(v[0], v[1], v[2]).norm() < 100)) file.refuse(node, what + " is too far");
  return {v[0], v[1], v[2]};
}

Eigen::Isometry3d readPose(const YamlSource& file, const YAML::Node& node,
                           const std::string& what) {
  file.requireKeys(node, what, {"translation", "rotation"});
  Eigen::Isometry3d T(readRotation(file, file.at(node, "rotation", what), what + "'s rotation"));
  T.translation() =
      readVector(file, file.at(node, "translation", what), what + "'s translation");
  return T;
}

std::string readFrame(const YamlSource& file, const YAML::Node& node, const std::string& what) {
  const std::string name = file.text(node, what);
  if (!isFrameName(name)) file.refuse(node, what + ": '" + name + "' is no tf2 frame name");
  return name;
}

TurretJoint readJoint(const YamlSource& file, const YAML::Node& node) {
  const std::string what = "a joint";
  file.requireKeys(node, what, {"parent", "link", "correction", "axis", "middle", "scale"});
  TurretJoint joint;
  joint.parent = readFrame(file, file.at(node, "parent", what), "'parent'");
  joint.link = readFrame(file, file.at(node, "link", what), "'link'");
  joint.correction = readPose(file, file.at(node, "correction", what), "'correction'");
  const YAML::Node axis = file.at(node, "axis", what), scale = file.at(node, "scale", what);
  joint.axis = readVector(file, axis, "'axis'");
  if (std::abs(joint.axis.norm() - 1) > 1e-3) file.refuse(axis, "'axis' should have length 1");
  joint.axis.normalize();
  joint.R_parent_middle = readRotation(file, file.at(node, "middle", what), "'middle'");
  joint.scale = file.number(scale, "'scale'");
  if (std::abs(joint.scale) > 0.5) file.refuse(scale, "'scale' should be -0.5 to 0.5");
  return joint;
}

}  // namespace

double TurretJoint::angle(const Eigen::Isometry3d& T_parent_link) const {
  return turnOf(R_parent_middle.inverse().toRotationMatrix() * T_parent_link.linear()).dot(axis);
}

Eigen::Isometry3d TurretJoint::corrected(const Eigen::Isometry3d& T_parent_link) const {
  return correction * T_parent_link * Eigen::AngleAxisd(scale * angle(T_parent_link), axis);
}

Eigen::Isometry3d Turret::T_base_projector(
    const std::vector<Eigen::Isometry3d>& T_parent_link) const {
  if (T_parent_link.size() != joints.size()) {
    throw std::invalid_argument("a turret of " + std::to_string(joints.size()) + " joints, not " +
                                std::to_string(T_parent_link.size()));
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < joints.size(); ++i) T = T * joints[i].corrected(T_parent_link[i]);
  return T * T_link_projector.matrix();
}

Eigen::Vector3d turnOf(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  const double angle = turn.angle() > M_PI ? turn.angle() - 2 * M_PI : turn.angle();
  return angle * turn.axis();
}

std::string turretYaml(const Turret& turret, const std::vector<std::string>& remarks) {
  std::string text =
      "# A turret as it is, by `afterglow calibrate mount`, for turret_tf_node: `correction` goes\n"
      "# before what tf says of the joint.\n";
  for (const std::string& remark : remarks) text += "# " + oneLine(remark) + "\n";
  text += "projector_frame: " + turret.projector_frame +
          "\nT_link_projector: " + poseText(turret.T_link_projector.matrix()) + "\njoints:\n";
  for (const TurretJoint& joint : turret.joints) text += jointText(joint);
  return text;
}

Turret loadTurret(const std::string& path) {
  const YamlSource file(path);
  const std::string what = "a turret";
  file.requireKeys(file.root(), what, {"projector_frame", "T_link_projector", "joints"});
  const auto at = [&](const char* key) { return file.at(file.root(), key, what); };
  Turret turret;
  turret.projector_frame = readFrame(file, at("projector_frame"), "'projector_frame'");
  turret.T_link_projector = Rigid<Link, Projector>(
      readPose(file, at("T_link_projector"), "'T_link_projector'"));
  const YAML::Node joints = at("joints");
  if (!joints.IsSequence() || joints.size() == 0) {
    file.refuse(joints, "'joints' should be a list of at least one");
  }
  for (const YAML::Node& joint : joints) {
    turret.joints.push_back(readJoint(file, joint));
    if (turret.joints.size() < 2) continue;
    const std::string& before = turret.joints[turret.joints.size() - 2].link;
    if (turret.joints.back().parent != before) {
      file.refuse(joint, "its 'parent' should be the link before, '" + before + "'");
    }
  }
  return turret;
}

std::string turretLaunch(const Turret& turret) {
  return fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<launch>\n"
      "  <!-- Where the projector sits in {}, as its turret turns, by\n"
      "       `afterglow calibrate mount` -->\n"
      "  <node pkg=\"afterglow\" type=\"turret_tf_node\" name=\"projector_tf\"\n"
      "        args=\"$(dirname)/turret.yaml\"/>\n"
      "</launch>\n",
      turret.joints.front().parent);
}

}  // namespace afterglow::calib
