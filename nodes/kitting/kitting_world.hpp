/// \file
/// The demo's room: what stands in it, and what a robot's camera and laser would see of it. Pure
/// geometry, no ROS. Frames: `map` (z up, floor at z = 0) unless named; metres, radians.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// Paint, sRGB components 0..1.
struct Paint {
  float r = 0.5f, g = 0.5f, b = 0.5f;
};

/// A piece of a thing, centered on its own origin.
struct Part {
  enum class Shape {
    Box,       ///< size = full edge lengths
    Cylinder,  ///< size = x, y diameters and height
    Prism,     ///< `outline` in x, y: counter-clockwise, all of it visible from its first corner
  };
  Shape shape = Shape::Box;
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  ///< z is every shape's height
  std::vector<Eigen::Vector2d> outline;
  Eigen::Isometry3d T_thing_part = Eigen::Isometry3d::Identity();
  Paint paint;
};

/// Something in the room.
struct Thing {
  std::string name;
  bool furniture = false;  ///< stays when the objects are removed
  bool low = false;        ///< stands on the floor where the base laser sees it as an obstacle
  std::optional<double> surface;  ///< height of a tabletop over the thing's origin
  Eigen::Isometry3d T_map_thing = Eigen::Isometry3d::Identity();
  std::vector<Part> parts;
};

/// Counter-clockwise seen from outside.
using Triangle = std::array<Eigen::Vector3d, 3>;

/// A part's surface in its own frame.
std::vector<Triangle> partTriangles(const Part& part);

/// Things of one room, by name.
class World {
 public:
  /// Throws std::invalid_argument if two things share a name.
  explicit World(std::vector<Thing> things);

  const std::vector<Thing>& things() const { return things_; }
  /// Throws std::invalid_argument, naming it, if there is no such thing.
  const Thing& thing(const std::string& name) const;
  /// Puts a thing elsewhere.
  void place(const std::string& name, const Eigen::Isometry3d& T_map_thing);

  /// Takes everything away but the furniture.
  void removeObjects();

  /// Points of the thing's surface in `map`, about `spacing` apart, that an eye there would see:
  /// facing it and hidden by nothing in the room.
  std::vector<Eigen::Vector3d> visiblePoints(const std::string& name, const Eigen::Vector3d& p_eye,
                                             double spacing) const;

  /// Distance along `direction` (unit length) to the first surface; empty: nothing there.
  /// `only_low`: ignore everything but obstacles on the floor.
  std::optional<double> castRay(const Eigen::Vector3d& p_origin, const Eigen::Vector3d& direction,
                                bool only_low = false) const;

 private:
  std::size_t indexOf(const std::string& name) const;

  std::vector<Thing> things_;
  std::vector<std::vector<Triangle>> surfaces_;  // of each thing, in map
};

/// A planar laser's beams: counter-clockwise about its frame's z, first at `angle_min`.
struct ScanGeometry {
  double angle_min = -1.92, angle_increment = 0.0058, range_max = 25;
  int beams = 662;
};

/// Ranges of a laser in the room that sees only obstacles on the floor; infinity where there is
/// none.
std::vector<float> scanObstacles(const World& world, const Eigen::Isometry3d& T_map_laser,
                                 const ScanGeometry& geometry);

/// Where the finite ranges of a scan lie, in `map`.
std::vector<Eigen::Vector3d> scanPoints(const std::vector<float>& ranges,
                                        const Eigen::Isometry3d& T_map_laser,
                                        const ScanGeometry& geometry);

}  // namespace afterglow::nodes
