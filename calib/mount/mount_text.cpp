#include "calib/mount/mount_text.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>

#include "calib/number_text.hpp"

namespace afterglow::calib {
namespace {

Eigen::Quaterniond rotationOf(const Mount& mount) {
  Eigen::Quaterniond q(mount.T_link_projector.matrix().linear());
  q.normalize();
  if (q.w() < 0) q.coeffs() *= -1;
  return q;
}

void writeSpread(YAML::Emitter& out, const char* key, const std::optional<double>& spread,
                 int decimals) {
  out << YAML::Key << key << YAML::Value;
  if (spread) {
    out << fixedText(*spread, decimals);
  } else {
    out << YAML::Null;
  }
}

void writePoses(YAML::Emitter& out, const Mount& mount) {
  out << YAML::Key << "poses" << YAML::Value << YAML::BeginSeq;
  for (const MountDeviation& pose : mount.poses) {
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "name" << YAML::Value << YAML::DoubleQuoted
        << pose.name << YAML::Key << "deviation_mm" << YAML::Value << fixedText(pose.mm, 3)
        << YAML::Key << "deviation_deg" << YAML::Value << fixedText(pose.deg, 4) << YAML::Key
        << "used" << YAML::Value << pose.is_used << YAML::EndMap;
  }
  out << YAML::EndSeq;
}

}  // namespace

std::string staticTransformYaml(const Mount& mount, const MountFrames& frames) {
  const Eigen::Vector3d t = mount.T_link_projector.matrix().translation();
  const Eigen::Quaterniond q = rotationOf(mount);
  YAML::Emitter out;
  out << YAML::BeginMap;
  out << YAML::Key << "parent_frame" << YAML::Value << frames.link;
  out << YAML::Key << "child_frame" << YAML::Value << frames.projector;
  out << YAML::Key << "translation" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
      << "x" << YAML::Value << exactText(t.x()) << YAML::Key << "y" << YAML::Value
      << exactText(t.y()) << YAML::Key << "z" << YAML::Value << exactText(t.z()) << YAML::EndMap
      << YAML::Comment("m");
  out << YAML::Key << "rotation" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "x"
      << YAML::Value << exactText(q.x()) << YAML::Key << "y" << YAML::Value << exactText(q.y())
      << YAML::Key << "z" << YAML::Value << exactText(q.z()) << YAML::Key << "w" << YAML::Value
      << exactText(q.w()) << YAML::EndMap;
  writeSpread(out, "spread_mm", mount.spread_mm, 3);
  writeSpread(out, "spread_deg", mount.spread_deg, 4);
  writePoses(out, mount);
  out << YAML::EndMap;
  return std::string("# From the link to the projector, by `afterglow calibrate mount`.\n") +
         out.c_str() + "\n";
}

std::string staticTransformLaunch(const Mount& mount, const MountFrames& frames,
                                  bool has_publisher) {
  for (const std::string& name : {frames.link, frames.projector}) {
    if (!isFrameName(name)) throw std::invalid_argument("'" + name + "' is no tf2 frame name");
  }
  const Eigen::Vector3d t = mount.T_link_projector.matrix().translation();
  const Eigen::Quaterniond q = rotationOf(mount);
  std::string arguments;
  for (const double number : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    arguments += exactText(number) + " ";
  }
  arguments += frames.link + " " + frames.projector;
  const auto node = [&](const std::string& condition, const std::string& program) {
    return "  <node " + condition + "=\"$(arg tf2_ros)\" " + program +
           " name=\"projector_tf\"\n        args=\"" + arguments + "\"/>\n";
  };
  return std::string(
             "<?xml version=\"1.0\"?>\n"
             "<launch>\n"
             "  <!-- Where the projector sits on the robot, by `afterglow calibrate mount`:\n"
             "       x y z qx qy qz qw parent child -->\n"
             "  <arg name=\"tf2_ros\" default=\"") +
         (has_publisher ? "true" : "false") +
         "\"\n       doc=\"false where tf2_ros has no static_transform_publisher, as on Debian "
         "12\"/>\n" +
         node("if", "pkg=\"tf2_ros\" type=\"static_transform_publisher\"") +
         node("unless", "pkg=\"afterglow\" type=\"static_transform_node\"") + "</launch>\n";
}

bool isFrameName(const std::string& name) {
  if (name.empty() || name.front() == '/') return false;
  return std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return c < 128 && (std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/');
  });
}

}  // namespace afterglow::calib
