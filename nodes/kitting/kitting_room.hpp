/// \file
/// The demo's room: what stands in it, and what a robot's camera and laser would see of it. No ROS
/// master is involved. Frames: `map` (z up, floor at z = 0) unless named; meters, radians.
#pragma once

#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/TransformStamped.h>
#include <sensor_msgs/LaserScan.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// Something in the room.
struct Thing {
  std::string name;
  bool is_furniture = false;  ///< stays when the objects are removed
  bool is_low = false;        ///< stands on the floor where the base laser sees it
  bool is_gone = false;       ///< only a bystander's ghost of it is left
  Eigen::Isometry3d T_map_thing = Eigen::Isometry3d::Identity();
  /// Cubes and Cylinders; each pose is in the thing.
  std::vector<render::Drawable> parts;

  std::string carrier = {};  ///< the link that it moves with, if it is carried
  Eigen::Isometry3d T_carrier_thing = Eigen::Isometry3d::Identity();
};

/// assets/demo/room.urdf explains itself. Throws std::runtime_error as RobotModel does.
std::vector<Thing> loadThings(const std::string& path);

class KittingRoom {
 public:
  /// Throws std::invalid_argument if two things share a name.
  explicit KittingRoom(std::vector<Thing> things);

  /// Throws std::invalid_argument, naming it, if there is no such thing.
  const Thing& thing(const std::string& name) const;

  /// Moves the thing with this link from now on; for eyes and laser it stays where it was.
  void carry(const std::string& name, const std::string& link,
             const Eigen::Isometry3d& T_link_thing);
  /// Lets go of a carried thing here.
  void putDown(const std::string& name, const Eigen::Isometry3d& T_map_thing);
  /// Takes everything away but the furniture: what is gone is seen by no eye and no laser.
  void removeObjects();

  /// The whole room for /room/solids: clears it, then a marker for each part, translucent for what
  /// is gone, and of that the large parts alone. Namespace: the thing's name, id: the part's index.
  visualization_msgs::MarkerArray markers() const;
  /// Returns the obstacles of a Fetch's base laser, as round things for the simulated one's
  /// /obstacles: position.z is the radius.
  geometry_msgs::PoseArray obstacles() const;
  /// Frames of the furniture: z up, origin in the middle of the tabletop.
  std::vector<geometry_msgs::TransformStamped> surfaces() const;

  /// Points of the thing that a depth camera there sees, hidden by nothing in the room; its rays
  /// are `spacing` apart at the thing's distance.
  std::vector<Eigen::Vector3d> visiblePoints(const std::string& name, const Eigen::Vector3d& p_eye,
                                             double spacing) const;
  /// Returns the scan of a Fetch's base laser that sees only obstacles on the floor; infinite where
  /// there is none.
  sensor_msgs::LaserScan scan(const Eigen::Isometry3d& T_map_laser) const;

 private:
  using Triangle = std::array<Eigen::Vector3d, 3>;
  struct Hit {
    double distance;
    std::size_t thing;
  };

  std::size_t indexOf(const std::string& name) const;
  static std::vector<Triangle> trianglesOf(const Thing& thing);
  /// The first surface along `direction` (unit length).
  std::optional<Hit> castRay(const Eigen::Vector3d& p_origin, const Eigen::Vector3d& direction,
                             bool only_low) const;

  std::vector<Thing> things_;
  std::vector<std::vector<Triangle>> surfaces_;  ///< surfaces of each thing, in map
};

/// An empty scan with the laser's angles: clears what was shown.
sensor_msgs::LaserScan noScan();
/// Returns the places of a scan's finite ranges, in `map`.
std::vector<Eigen::Vector3d> scanPoints(const sensor_msgs::LaserScan& scan,
                                        const Eigen::Isometry3d& T_map_laser);

}  // namespace afterglow::nodes
