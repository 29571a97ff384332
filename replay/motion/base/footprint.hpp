/// \file
/// The outline of a robot's base on the floor, in the base's frame: meters, x ahead, y left.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace afterglow::replay {

struct FloorPoint {
  double x = 0, y = 0;
};

/// m from the line between a and b, which may be a point.
double distanceToLine(const FloorPoint& a, const FloorPoint& b, const FloorPoint& p);

/// A convex outline; a value.
class Footprint {
 public:
  /// About the base's origin.
  static Footprint circle(double radius);
  /// The hull of these corners, given in any order. Throws std::invalid_argument unless they span
  /// an area.
  static Footprint polygon(const std::vector<std::array<double, 2>>& corners);

  /// m from the outline; negative inside.
  double distanceTo(const FloorPoint& point) const;
  /// m from the origin to its farthest point.
  double radius() const { return radius_; }
  /// Points all along it, at most 0.1 m apart.
  std::vector<FloorPoint> outline() const;

 private:
  std::vector<FloorPoint> corners_;  ///< counter-clockwise; one: of a circle
  double rounding_ = 0;              ///< m that the outline lies outside of the corners' hull
  double radius_ = 0;
};

/// "0.3", the radius of a circle, or the corners "0.3,0.2 -0.3,0.2 -0.3,-0.2 0.3,-0.2". Throws
/// std::invalid_argument, one line.
Footprint parseFootprint(const std::string& text);

}  // namespace afterglow::replay
