/// \file
/// The way of the base during a behavior, as a function of recorded time: the track of a replay's
/// drive.
#pragma once

#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {

inline double secondsBetween(Stamp from, Stamp to) {
  return static_cast<double>(to.ns - from.ns) * 1e-9;
}
inline Stamp later(Stamp stamp, double seconds) {
  return {stamp.ns + static_cast<std::int64_t>(seconds * 1e9)};
}

struct StampedPose {
  Stamp stamp;
  PlanarPose pose;
};

/// A while of a track.
struct TrackSpan {
  Stamp from, to;
};

/// The localization changed its mind about where the base was.
struct TrackJump {
  Stamp at;
  double distance = 0, turn = 0;  ///< m, rad; of the base
};

/// A value; at least one pose.
class PoseTrack {
 public:
  using Sample = StampedPose;

  /// `frame` is the poses' ("map"); is_localized: that frame is one that localization knows again,
  /// not the odometry's. Stamps must rise; throws std::invalid_argument if they do not, or if there
  /// is no sample.
  PoseTrack(std::vector<Sample> samples, std::string frame, bool is_localized);

  Stamp begin() const { return samples_.front().stamp; }
  Stamp end() const { return samples_.back().stamp; }
  const PlanarPose& startPose() const { return samples_.front().pose; }
  const PlanarPose& endPose() const { return samples_.back().pose; }
  /// Returns the pose at any recorded stamp, interpolated; before and after the track its ends.
  PlanarPose at(Stamp stamp) const;
  /// The mean over 0.1 s around the stamp, negative when it drove backward; zero off the track. To
  /// the left a base that cannot go there has noise.
  PlanarVelocity velocityAt(Stamp stamp) const;
  /// Returns the headings since the base came to the place of its end for the last time, as seen
  /// from its last heading; at most 2.8 rad to either side. `radius`: of that place, m.
  HeadingRange headingsAtEnd(double radius) const;
  /// Meters driven, forward and backward.
  double length() const { return length_; }

  const std::string& frame() const { return frame_; }
  bool isLocalized() const { return is_localized_; }
  std::size_t sampleCount() const { return samples_.size(); }
  /// Returns the part in [from, to], clamped to the track, which begins and ends as this one is
  /// there. Stands, gaps and remarks stay behind, errors are kept.
  PoseTrack part(Stamp from, Stamp to) const;

  std::vector<TrackSpan> stands;  ///< a second at least without motion by odometry
  std::vector<TrackSpan> gaps;    ///< spans without any pose; the track goes straight through them
  std::vector<TrackJump> jumps;
  /// Standard deviations on the map: of where it begins and ends, and of one measurement of the
  /// localization, judged by how far it moved the base each time. 0 if it is not localized.
  PoseError begin_error, end_error, measured_error;
  /// Remarks for people on how it came about, a sentence each; gaps and jumps among them.
  std::vector<std::string> remarks;

 private:
  std::vector<Sample> samples_;
  std::string frame_;
  bool is_localized_;
  double length_ = 0;
};

/// Returns why the track cannot be followed where the base was in motion, from `first` to `last`:
/// it begins or ends more than half a second off, or the base went more than 0.1 m or 0.25 rad in a
/// gap. A clause; empty: it can.
std::string whyIncomplete(const PoseTrack& track, Stamp first, Stamp last);

}  // namespace afterglow::replay
