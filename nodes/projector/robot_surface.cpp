#include "nodes/projector/robot_surface.hpp"

#include <ros/time.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "render/paint/dark_mask.hpp"

namespace afterglow::nodes {
namespace {

constexpr int kLongestChain = 100;

/// The link that carries others rigidly, and where they are on it.
struct Carrier {
  std::string link;
  Eigen::Isometry3d T_carrier_link = Eigen::Isometry3d::Identity();
};

std::map<std::string, Carrier> carriersOf(const RobotModel& model) {
  std::map<std::string, Carrier> carriers = {{model.rootLink(), {model.rootLink()}}};
  for (const Joint& joint : model.joints()) {  // parents first
    const Carrier& parent = carriers.at(joint.parent);
    carriers[joint.child] =
        joint.moves() ? Carrier{joint.child}
                      : Carrier{parent.link, parent.T_carrier_link * joint.T_parent_joint};
  }
  return carriers;
}

}  // namespace

RobotSurface::RobotSurface(const RobotModel& model, const replay::RobotNames& names) {
  const std::map<std::string, Carrier> carriers = carriersOf(model);
  std::map<std::string, Part> parts;
  for (const auto& [link, carrier] : carriers) {
    Part& part = parts[carrier.link];
    part.frame = names.frame(carrier.link);
    part.links.insert(names.frame(link));
    links_.insert(names.frame(link));
  }
  for (const LinkVisual& visual : model.visuals()) {
    const Carrier& carrier = carriers.at(visual.link);
    const Eigen::Isometry3f T_carrier_shape =
        (carrier.T_carrier_link * visual.T_link_shape).cast<float>();
    if (!T_carrier_shape.matrix().allFinite()) {
      throw std::runtime_error("link " + visual.link + ": its place is not finite");
    }
    std::vector<Eigen::Vector3f>& points = parts[carrier.link].points.edit();
    try {
      for (const Eigen::Vector3f& p : render::surfacePoints(visual.shape, kSpacing)) {
        points.push_back(T_carrier_shape * p);
      }
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("link " + visual.link + ": " + error.what());
    }
  }
  for (auto& [link, part] : parts) {
    if (!part.points.empty()) parts_.push_back(std::move(part));
  }
}

std::optional<std::size_t> RobotSurface::partOf(const std::string& frame,
                                                const tf2::BufferCore& buffer) const {
  std::string link = frame, parent;
  for (int i = 0; i < kLongestChain && links_.count(link) == 0; ++i, link = parent) {
    if (!buffer._getParent(link, ros::Time(0), parent)) return std::nullopt;
  }
  const auto carries = [&](const Part& part) { return part.links.count(link) > 0; };
  const auto found = std::find_if(parts_.begin(), parts_.end(), carries);
  if (found == parts_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - parts_.begin());
}

RobotSurfaceReader::RobotSurfaceReader(std::string description, std::vector<std::string> mesh_roots,
                                       const tf2::BufferCore& buffer)
    : description_(std::move(description)), mesh_roots_(std::move(mesh_roots)), buffer_(buffer) {}

std::optional<RobotSurface> RobotSurfaceReader::read() {
  const std::string name_space = rosNamespace();
  const std::string xml = robotParameter(name_space, description_);
  if (xml != xml_ || xml.empty()) readModel(xml);
  if (!model_) return std::nullopt;
  const auto isKnown = [&](const std::string& frame) { return buffer_._frameExists(frame); };
  const replay::RobotNames names =
      replay::findRobotNames(name_space, robotParameter(name_space, "tf_prefix"), isKnown);
  const std::string root = names.frame(model_->rootLink());
  try {
    if (isKnown(root)) return RobotSurface(*model_, names);
  } catch (const std::runtime_error& error) {
    model_.reset();
    reason_ = description_ + ": " + error.what();
    return std::nullopt;
  }
  reason_ = "tf does not know the robot's '" + printable(root) + "' of parameter " + description_;
  return std::nullopt;
}

void RobotSurfaceReader::readModel(const std::string& xml) {
  xml_ = xml;
  model_.reset();
  reason_.clear();
  if (xml.empty()) {
    reason_ = "no robot's description on parameter " + description_;
    return;
  }
  try {
    MeshLibrary meshes(mesh_roots_);
    RobotModel model = RobotModel::fromXml(
        xml, description_, robotMeshes(meshes, [&](const std::string& why) { reason_ = why; }));
    if (model.visuals().empty() && reason_.empty()) reason_ = description_ + ": no link is visible";
    if (reason_.empty()) model_ = std::move(model);
  } catch (const std::runtime_error& error) {
    reason_ = error.what();
  }
}

}  // namespace afterglow::nodes
