/// \file
/// The floor that a base sweeps on its way, and how far that is free. Pure; base frame: meters,
/// radians.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "replay/motion/base/floor_scan.hpp"
#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {

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
