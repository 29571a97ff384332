/// \file
/// The floor that a base sweeps on its way, and how far that is free. Pure; base frame: meters,
/// radians.
///
/// A range finder's view of the floor around a base: points, and the directions that it sees. Base
/// frame: meters, x ahead, y left; radians, counter-clockwise.
///
/// The outline of a robot's base on the floor, in the base's frame: meters, x ahead, y left.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/motion/pose_track.hpp"

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
  std::vector<FloorPoint> corners_;  ///< counter-clockwise; none: a circle
  double radius_ = 0;
};

/// "0.3", the radius of a circle, or the corners "0.3,0.2 -0.3,0.2 -0.3,-0.2 0.3,-0.2". Throws
/// std::invalid_argument, one line.
Footprint parseFootprint(const std::string& text);

/// A sensor_msgs/LaserScan: angles about the range finder's z.
struct RangeScan {
  Stamp stamp;
  double angle_min = 0, angle_increment = 0;
  double range_min = 0, range_max = 0;
  std::vector<float> ranges;
};

/// The place of the range finder on the base: its origin, and its axes x and y seen from above. One
/// that is mounted upside down has its y axis reversed.
struct ScanMount {
  FloorPoint origin;
  FloorPoint x_axis{1, 0}, y_axis{0, 1};
};

/// A part of the robot that crosses the plane of the scan: what is seen so near to this line is
/// the robot's own.
struct OwnPart {
  FloorPoint from, to;
  double radius = 0;  ///< m
};

/// A value. NaN, infinite ranges and those out of the limits give no points; what is the robot's
/// own gives none either.
class FloorScan {
 public:
  struct Point {
    FloorPoint at;
    std::size_t beam = 0;
    double range = 0;  ///< m
  };

  /// `own_outline`: what is seen within it is the robot's own; nullptr: it is not known. Throws
  /// std::invalid_argument, one line, for angles or limits that are no numbers.
  FloorScan(const RangeScan& scan, const ScanMount& mount, const Footprint* own_outline,
            const std::vector<OwnPart>& own_parts);

  Stamp stamp() const { return stamp_; }
  const std::vector<Point>& points() const { return points_; }
  /// rad between two beams
  double increment() const { return increment_; }
  /// No beam measured anything: it says nothing, least of all that all is free.
  bool isBlind() const { return is_blind_; }
  /// A beam looks that way and is neither hidden by the robot nor without a measurement. Infinite
  /// ranges are measurements, of nothing.
  bool sees(const FloorPoint& point) const;
  /// Returns how much farther than the point the nearest thing within `beside` m of it lies, m:
  /// below zero before the point. Infinite: nothing is seen; empty: nobody looks.
  std::optional<double> beyond(const FloorPoint& point, double beside) const;

 private:
  std::ptrdiff_t beamTo(const FloorPoint& point) const;

  Stamp stamp_;
  double angle_min_, increment_;
  ScanMount mount_;
  std::vector<Point> points_;
  std::vector<double> ranges_;  ///< infinite: nothing is there; NaN: blind
  bool is_blind_ = true;
};

/// The place of a base in the near future, as seen from where it is.
struct SweptPose {
  PlanarPose T_base_then;
  double way = 0;  ///< m that the footprint's farthest point has gone by then
};
using SweptPath = std::vector<SweptPose>;

/// A point of a frame in its parent's.
FloorPoint transformed(const PlanarPose& T, const FloorPoint& p);

/// Returns the greatest speed of the footprint's farthest point: m/s.
double rimSpeed(const PlanarVelocity& velocity, double radius);

/// Along a track from a moment on; the base is at `base`, in the track's frame. Ends with the
/// track, or after `longest` m.
SweptPath pathAlong(const PoseTrack& track, Stamp from, const PlanarPose& base, double radius,
                    double longest, bool is_holonomic = false);
/// The way of a velocity that is kept.
SweptPath pathOf(const PlanarVelocity& velocity, double radius, double longest);

struct FreeWay {
  double way = std::numeric_limits<double>::infinity();  ///< m; infinite: all of the path is free
  std::optional<FloorPoint> obstacle;                    ///< the obstacle at its end, seen from now
  double distance = std::numeric_limits<double>::infinity();  ///< m of that from the footprint now
};

/// Returns how far the footprint, `clearance` m wider all around, goes along the path before it
/// meets one of the points. What stands nearer than that already bars the way only to what would
/// come nearer still: nobody is kept from driving away from a table.
FreeWay freeWay(const SweptPath& path, const Footprint& footprint, double clearance,
                const std::vector<FloorPoint>& points);

/// Returns true if the scan looks where the footprint gets to next, for the most part.
bool isSeen(const SweptPath& path, const Footprint& footprint, const FloorScan& scan);

}  // namespace afterglow::replay
