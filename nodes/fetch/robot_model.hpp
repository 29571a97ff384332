/// \file
/// A robot from its URDF: where every link is, what it looks like, and how to reach a pose or point
/// something at a place. Meters, radians. Source of semantics: http://wiki.ros.org/urdf/XML.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/conversion/mesh_library.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

using JointPositions = std::map<std::string, double>;        ///< rad, or m for a prismatic joint
using LinkPoses = std::map<std::string, Eigen::Isometry3d>;  ///< T_root_link of every link

/// A joint of the tree, fixed ones included.
struct Joint {
  enum class Kind { Fixed, Revolute, Continuous, Prismatic } kind = Kind::Fixed;
  std::string name, parent, child;  ///< child and parent are links
  Eigen::Isometry3d T_parent_joint = Eigen::Isometry3d::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< axis in the joint's frame, of length 1
  double lower = 0, upper = 0;                      ///< infinite for a continuous joint
  double max_velocity = 0;                          ///< rad/s or m/s; infinite where none is given

  bool moves() const { return kind != Kind::Fixed; }
  /// The child's pose in the parent with the joint at `position` (ignored by a fixed joint).
  Eigen::Isometry3d T_parent_child(double position) const;
};

/// A joint that `positions` lacks rests: at 0, or at its limit nearest to 0.
double positionOf(const Joint& joint, const JointPositions& positions);

/// A shape of a link, in its color.
struct LinkVisual {
  std::string link;
  Eigen::Isometry3d T_link_shape = Eigen::Isometry3d::Identity();
  render::Shape shape;  ///< Cube, Cylinder, Sphere or MeshInstance
  render::Color color;
};

/// Two joints that point something: a pan-tilt turret or a head.
struct PanTilt {
  std::string pan_joint, tilt_joint;
  std::string frame;  ///< the link that the pointed direction is given in
};

/// Triangles of a mesh that a URDF names, package:// or file://; none: the shape is left out.
using MeshReader = std::function<render::SharedBody(const std::string& resource)>;
/// Reads a robot's meshes by a library that outlives it. `tell` hears why one is left out.
MeshReader robotMeshes(MeshLibrary& library, std::function<void(const std::string& why)> tell);

/// A value: copy it freely; const members are safe from any thread.
class RobotModel {
 public:
  /// Reads a model; both throw std::runtime_error naming the file (or `name`) and what is wrong
  /// with it: not a URDF, an unsupported joint type, or, without a reader for it, a mesh.
  static RobotModel fromFile(const std::string& path, const MeshReader& read_mesh = {});
  static RobotModel fromXml(const std::string& xml, const std::string& name = "robot_description",
                            const MeshReader& read_mesh = {});

  const std::string& rootLink() const { return root_; }
  /// The joints, a parent's before its children's.
  const std::vector<Joint>& joints() const { return joints_; }
  /// Throws std::out_of_range naming the joint if there is none.
  const Joint& joint(const std::string& name) const;
  /// Returns the rest positions of all moving joints.
  JointPositions restPositions() const;

  /// A link's pose in the root. Joints missing from `positions` rest, unknown names are ignored.
  /// Throws std::out_of_range naming the link if there is none.
  Eigen::Isometry3d linkPose(const std::string& link, const JointPositions& positions) const;

  const std::vector<LinkVisual>& visuals() const { return visuals_; }
  /// The visuals as solids in the world; links that `T_world_link` lacks are left out.
  std::vector<render::Drawable> drawables(const LinkPoses& T_world_link) const;

  /// Joint positions that bring `tip_link` to `T_root_tip` (within 0.1 mm and 0.1 mrad) and obey
  /// the limits: the nearest to `seed` found in a fixed number of deterministic starts. Joints in
  /// `held` stay at their seed. The result holds the chain's joints only (root to tip, the moving
  /// ones). Empty if none was found. Throws std::out_of_range for an unknown link.
  std::optional<JointPositions> solveIk(const std::string& tip_link,
                                        const Eigen::Isometry3d& T_root_tip,
                                        const JointPositions& seed,
                                        const std::set<std::string>& held = {}) const;

  /// Pan and tilt that make the ray from the origin of `turret.frame` along `direction` (in that
  /// frame, any length) hit `p_root`; `positions` says where the other joints are and seeds the
  /// search. Empty if the limits do not allow it. Throws std::out_of_range for unknown names.
  ///
  /// To center a projector's image on a point, whatever its lens shift:
  ///   aim(kProjectorTurret, *calib::unproject(lens, image_center_px), p_base, positions)
  std::optional<JointPositions> aim(const PanTilt& turret, const Eigen::Vector3d& direction,
                                    const Eigen::Vector3d& p_root,
                                    const JointPositions& positions) const;

 private:
  /// Joints from the root to a link.
  std::vector<const Joint*> chainTo(const std::string& link) const;

  std::string root_;
  std::vector<Joint> joints_;
  std::vector<LinkVisual> visuals_;
};

}  // namespace afterglow::nodes
