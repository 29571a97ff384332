#include "nodes/fetch/robot_model.hpp"

#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <variant>

namespace afterglow::nodes {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::Vector3d toEigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Eigen::Isometry3d toEigen(const urdf::Pose& pose) {
  const urdf::Rotation& q = pose.rotation;
  return Eigen::Translation3d(toEigen(pose.position)) * Eigen::Quaterniond(q.w, q.x, q.y, q.z);
}

Joint::Kind kindOf(const urdf::Joint& joint, const std::string& name) {
  switch (joint.type) {
    case urdf::Joint::FIXED:
      return Joint::Kind::Fixed;
    case urdf::Joint::REVOLUTE:
      return Joint::Kind::Revolute;
    case urdf::Joint::CONTINUOUS:
      return Joint::Kind::Continuous;
    case urdf::Joint::PRISMATIC:
      return Joint::Kind::Prismatic;
    default:
      throw std::runtime_error(name + ": joint " + joint.name +
                               " is neither fixed, revolute, continuous nor prismatic");
  }
}

Joint convertJoint(const urdf::Joint& source, const std::string& name) {
  Joint joint;
  joint.kind = kindOf(source, name);
  joint.name = source.name;
  joint.parent = source.parent_link_name;
  joint.child = source.child_link_name;
  joint.T_parent_joint = toEigen(source.parent_to_joint_origin_transform);
  if (!joint.moves()) return joint;
  const Eigen::Vector3d axis = toEigen(source.axis);
  if (axis.norm() < 1e-9)
    throw std::runtime_error(name + ": joint " + source.name + " has no axis");
  joint.axis = axis.normalized();
  const bool bounded = joint.kind != Joint::Kind::Continuous;
  if (bounded && !source.limits)
    throw std::runtime_error(name + ": joint " + source.name + " needs a limit");
  joint.lower = bounded ? source.limits->lower : -kInfinity;
  joint.upper = bounded ? source.limits->upper : kInfinity;
  joint.max_velocity =
      source.limits && source.limits->velocity > 0 ? source.limits->velocity : kInfinity;
  return joint;
}

/// Empty for a mesh that cannot be read.
std::optional<render::Shape> convertShape(const urdf::Geometry& geometry, const std::string& where,
                                          const MeshReader& read_mesh) {
  if (const auto* box = dynamic_cast<const urdf::Box*>(&geometry))
    return render::Cube{toEigen(box->dim).cast<float>()};
  if (const auto* ball = dynamic_cast<const urdf::Sphere*>(&geometry))
    return render::Sphere{Eigen::Vector3f::Constant(static_cast<float>(2 * ball->radius))};
  if (const auto* can = dynamic_cast<const urdf::Cylinder*>(&geometry))
    return render::Cylinder{
        Eigen::Vector3d(2 * can->radius, 2 * can->radius, can->length).cast<float>()};
  const auto* mesh = dynamic_cast<const urdf::Mesh*>(&geometry);
  if (!mesh || !read_mesh)
    throw std::runtime_error(where + " has a mesh; only boxes, cylinders and spheres are drawn");
  const render::SharedBody body = read_mesh(mesh->filename);
  if (!body) return std::nullopt;
  return render::MeshInstance{body, toEigen(mesh->scale).cast<float>(), false};
}

std::optional<LinkVisual> convertVisual(const std::string& link, const urdf::Visual& source,
                                        const std::string& name, const MeshReader& read_mesh) {
  if (!source.geometry) throw std::runtime_error(name + ": a visual of " + link + " has no shape");
  const auto shape = convertShape(*source.geometry, name + ": link " + link, read_mesh);
  if (!shape) return std::nullopt;
  LinkVisual visual;
  visual.link = link;
  visual.T_link_shape = toEigen(source.origin);
  visual.shape = *shape;
  if (source.material) {
    const urdf::Color& c = source.material->color;
    visual.color = {c.r, c.g, c.b, c.a};
  } else if (auto* mesh = std::get_if<render::MeshInstance>(&visual.shape)) {
    mesh->own_colors = true;
  }
  return visual;
}

}  // namespace

Eigen::Isometry3d Joint::T_parent_child(double position) const {
  switch (kind) {
    case Kind::Fixed:
      return T_parent_joint;
    case Kind::Prismatic:
      return T_parent_joint * Eigen::Translation3d(axis * position);
    default:
      return T_parent_joint * Eigen::AngleAxisd(position, axis);
  }
}

RobotModel RobotModel::fromFile(const std::string& path, const MeshReader& read_mesh) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened");
  std::ostringstream text;
  text << file.rdbuf();
  return fromXml(text.str(), path, read_mesh);
}

RobotModel RobotModel::fromXml(const std::string& xml, const std::string& name,
                               const MeshReader& read_mesh) {
  const urdf::ModelInterfaceSharedPtr source = urdf::parseURDF(xml);
  if (!source || !source->getRoot()) throw std::runtime_error(name + ": not a URDF robot");
  RobotModel model;
  model.root_ = source->getRoot()->name;
  std::vector<urdf::LinkConstSharedPtr> open = {source->getRoot()};
  for (std::size_t i = 0; i < open.size(); ++i) {  // breadth first: parents before children
    const urdf::LinkConstSharedPtr link = open[i];
    for (const auto& source_visual : link->visual_array) {
      auto visual = convertVisual(link->name, *source_visual, name, read_mesh);
      if (visual) model.visuals_.push_back(std::move(*visual));
    }
    for (const auto& joint : link->child_joints)
      model.joints_.push_back(convertJoint(*joint, name));
    open.insert(open.end(), link->child_links.begin(), link->child_links.end());
  }
  return model;
}

const Joint& RobotModel::joint(const std::string& name) const {
  for (const Joint& joint : joints_)
    if (joint.name == name) return joint;
  throw std::out_of_range("the robot has no joint " + name);
}

double positionOf(const Joint& joint, const JointPositions& positions) {
  const auto found = positions.find(joint.name);
  return found != positions.end() ? found->second : std::clamp(0.0, joint.lower, joint.upper);
}

JointPositions RobotModel::restPositions() const {
  JointPositions positions;
  for (const Joint& joint : joints_)
    if (joint.moves()) positions[joint.name] = positionOf(joint, {});
  return positions;
}

std::vector<const Joint*> RobotModel::chainTo(const std::string& link) const {
  std::vector<const Joint*> chain;
  std::string tip = link;
  for (auto joint = joints_.rbegin(); joint != joints_.rend(); ++joint) {
    if (joint->child != tip) continue;
    chain.push_back(&*joint);
    tip = joint->parent;
  }
  if (tip != root_) throw std::out_of_range("the robot has no link " + link);
  std::reverse(chain.begin(), chain.end());
  return chain;
}

Eigen::Isometry3d RobotModel::linkPose(const std::string& link,
                                       const JointPositions& positions) const {
  Eigen::Isometry3d T_root_link = Eigen::Isometry3d::Identity();
  for (const Joint* joint : chainTo(link))
    T_root_link = T_root_link * joint->T_parent_child(positionOf(*joint, positions));
  return T_root_link;
}

std::vector<render::Drawable> RobotModel::drawables(const LinkPoses& T_world_link) const {
  std::vector<render::Drawable> solids;
  for (const LinkVisual& visual : visuals_) {
    const auto link = T_world_link.find(visual.link);
    if (link == T_world_link.end()) continue;
    solids.push_back(
        {Rigid<World, World>(link->second * visual.T_link_shape), visual.shape, visual.color});
  }
  return solids;
}

}  // namespace afterglow::nodes
