// RobotModel's inverse kinematics: KDL's Levenberg-Marquardt from a few starts, and aiming.

#include "nodes/fetch/robot_model.hpp"

#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <kdl/chain.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <limits>
#include <random>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <variant>

#include "replay/motion/planar_pose.hpp"

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

MeshReader robotMeshes(MeshLibrary& library, std::function<void(const std::string& why)> tell) {
  return [&library, tell = std::move(tell)](const std::string& resource) -> render::SharedBody {
    const MeshLibrary::Mesh mesh = library.get(resource);
    if (mesh.value) return *mesh.value;
    tell(mesh.reason);
    return nullptr;
  };
}

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

namespace {

constexpr int kStarts = 60;
constexpr int kEnough = 5;  ///< solutions to choose the nearest from
using replay::kPi, replay::wrapAngle;

KDL::Vector toKdl(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

KDL::Frame toKdl(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  return {KDL::Rotation::Quaternion(q.x(), q.y(), q.z(), q.w()), toKdl(T.translation())};
}

/// The chain as KDL sees it: held and fixed joints become part of the links.
struct KdlChain {
  KDL::Chain chain;
  std::vector<const Joint*> joints;  ///< the free ones
};

KdlChain makeKdlChain(const std::vector<const Joint*>& path, const JointPositions& seed,
                      const std::set<std::string>& held) {
  KdlChain result;
  for (const Joint* joint : path) {
    if (!joint->moves() || held.count(joint->name)) {
      const double position = joint->moves() ? seed.at(joint->name) : 0.0;
      result.chain.addSegment(KDL::Segment(KDL::Joint(), toKdl(joint->T_parent_child(position))));
      continue;
    }
    const Eigen::Vector3d axis = joint->T_parent_joint.linear() * joint->axis;
    const auto type =
        joint->kind == Joint::Kind::Prismatic ? KDL::Joint::TransAxis : KDL::Joint::RotAxis;
    result.chain.addSegment(KDL::Segment(
        KDL::Joint(joint->name, toKdl(joint->T_parent_joint.translation()), toKdl(axis), type),
        toKdl(joint->T_parent_joint)));
    result.joints.push_back(joint);
  }
  return result;
}

/// A start for the search: the seed, then ever further from it. Plain arithmetic on mt19937's
/// output, since the standard's distributions differ between libraries.
KDL::JntArray makeStart(const KdlChain& chain, const KDL::JntArray& seed, int attempt,
                        std::mt19937& random) {
  KDL::JntArray start = seed;
  const double spread = std::min(1.0, 0.05 * attempt);
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const Joint& joint = *chain.joints[i];
    const bool endless = joint.kind == Joint::Kind::Continuous;
    const double half = endless ? kPi : (joint.upper - joint.lower) / 2;
    const double unit = static_cast<double>(random()) / 4294967295.0 * 2 - 1;
    const auto k = static_cast<unsigned>(i);
    start(k) = std::clamp(seed(k) + spread * half * unit, joint.lower, joint.upper);
  }
  return start;
}

/// Turns revolute joints by whole turns toward the seed and checks the limits.
bool settle(const KdlChain& chain, const KDL::JntArray& seed, KDL::JntArray& q) {
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const Joint& joint = *chain.joints[i];
    const auto k = static_cast<unsigned>(i);
    if (joint.kind == Joint::Kind::Continuous)
      q(k) = seed(k) + wrapAngle(q(k) - seed(k));
    if (joint.kind == Joint::Kind::Revolute) q(k) = wrapAngle(q(k));
    if (q(k) < joint.lower || q(k) > joint.upper) return false;
  }
  return true;
}

/// The largest move of one joint, a meter of torso counted as ten radians (it is as slow).
double effort(const KdlChain& chain, const KDL::JntArray& from, const KDL::JntArray& to) {
  double worst = 0;
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const auto k = static_cast<unsigned>(i);
    const double scale = chain.joints[i]->kind == Joint::Kind::Prismatic ? 10 : 1;
    worst = std::max(worst, scale * std::abs(to(k) - from(k)));
  }
  return worst;
}

std::optional<KDL::JntArray> nearestSolution(const KdlChain& chain, const KDL::Frame& goal,
                                             const KDL::JntArray& seed) {
  // 1 mrad weighs as much as 0.1 mm: both have to be right.
  Eigen::Matrix<double, 6, 1> weights;
  weights << 1, 1, 1, 0.5, 0.5, 0.5;
  KDL::ChainIkSolverPos_LMA solver(chain.chain, weights, 1e-6, 200);
  std::mt19937 random(1);
  std::optional<KDL::JntArray> best;
  int found = 0;
  for (int attempt = 0; attempt < kStarts && found < kEnough; ++attempt) {
    KDL::JntArray q(seed.rows());
    if (solver.CartToJnt(makeStart(chain, seed, attempt, random), goal, q) < 0) continue;
    if (!settle(chain, seed, q)) continue;
    ++found;
    if (!best || effort(chain, seed, q) < effort(chain, seed, *best)) best = q;
  }
  return best;
}

/// Returns how far the ray passes the target: 0 on it, 2 pointing the other way.
Eigen::Vector3d missOf(const Eigen::Isometry3d& T_root_frame, const Eigen::Vector3d& direction,
                       const Eigen::Vector3d& p_root) {
  return (T_root_frame.inverse() * p_root).normalized() - direction.normalized();
}

/// Gauss-Newton on two angles, derivatives by differences. Empty if it does not get there.
template <typename Miss>
std::optional<Eigen::Vector2d> refineAim(const Miss& missAt, Eigen::Vector2d q) {
  constexpr double kNudge = 1e-6;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector3d miss = missAt(q);
    if (miss.norm() < 1e-7) return q;
    Eigen::Matrix<double, 3, 2> slope;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d aside = q + kNudge * Eigen::Vector2d::Unit(k);
      slope.col(k) = (missAt(aside) - miss) / kNudge;
    }
    Eigen::Vector2d step = slope.colPivHouseholderQr().solve(miss);
    const double longest = step.cwiseAbs().maxCoeff();
    if (longest > 0.5) step *= 0.5 / longest;
    q -= step;
  }
  return std::nullopt;
}

}  // namespace

std::optional<JointPositions> RobotModel::solveIk(const std::string& tip_link,
                                                  const Eigen::Isometry3d& T_root_tip,
                                                  const JointPositions& seed,
                                                  const std::set<std::string>& held) const {
  const std::vector<const Joint*> path = chainTo(tip_link);
  JointPositions all = restPositions();
  for (const auto& [name, position] : seed) all[name] = position;
  const KdlChain chain = makeKdlChain(path, all, held);
  KDL::JntArray from(static_cast<unsigned>(chain.joints.size()));
  for (std::size_t i = 0; i < chain.joints.size(); ++i)
    from(static_cast<unsigned>(i)) = all.at(chain.joints[i]->name);
  const auto solution = nearestSolution(chain, toKdl(T_root_tip), from);
  if (!solution) return std::nullopt;
  JointPositions result;
  for (const Joint* joint : path)
    if (joint->moves()) result[joint->name] = all.at(joint->name);
  for (std::size_t i = 0; i < chain.joints.size(); ++i)
    result[chain.joints[i]->name] = (*solution)(static_cast<unsigned>(i));
  return result;
}

std::optional<JointPositions> RobotModel::aim(const PanTilt& turret,
                                              const Eigen::Vector3d& direction,
                                              const Eigen::Vector3d& p_root,
                                              const JointPositions& positions) const {
  const Joint *pan = &joint(turret.pan_joint), *tilt = &joint(turret.tilt_joint);
  const auto missAt = [&](const Eigen::Vector2d& q) {
    JointPositions all = positions;
    all[pan->name] = q[0], all[tilt->name] = q[1];
    return missOf(linkPose(turret.frame, all), direction, p_root);
  };
  const Eigen::Vector2d lower(pan->lower, tilt->lower), upper(pan->upper, tilt->upper);
  const Eigen::Vector2d now(positionOf(*pan, positions), positionOf(*tilt, positions));
  for (const Eigen::Vector2d& start : {now, Eigen::Vector2d(0, 0)}) {
    const std::optional<Eigen::Vector2d> q = refineAim(missAt, start);
    if (q && (q->array() >= lower.array()).all() && (q->array() <= upper.array()).all())
      return JointPositions{{pan->name, (*q)[0]}, {tilt->name, (*q)[1]}};
  }
  return std::nullopt;
}

}  // namespace afterglow::nodes
