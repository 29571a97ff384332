/// \file
/// Makes a pose track of what was recorded: odometry gives its shape, localization its place.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/base/base_localizer.hpp"
#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {

/// Poses closer than 20 ms are left out, and of a very long track (more than 200,000 poses) every
/// second one, as often as it takes: memory is bounded.
class TrackBuilder {
 public:
  explicit TrackBuilder(const LocalizationNoise& noise) : noise_(noise) {}

  /// The base in the odometry's frame. What is not newer than the last one is left out and counted.
  void addOdometry(Stamp stamp, const PlanarPose& T_odom_base);
  /// The odometry's frame on the map, from this stamp on. Repeated ones cost nothing.
  void addLocalization(Stamp stamp, const PlanarPose& T_map_odom);

  /// True while the base stands where the last pose has it.
  bool endsAt(const PlanarPose& T_odom_base) const;
  bool hasOdometry() const { return !poses_.empty(); }
  bool isLocalized() const { return !corrections_.empty(); }

  /// The track, with what was added used up; there must be odometry (std::invalid_argument). The
  /// odometry's stamps are moved by `odometry_shift` nanoseconds, to the localization's clock.
  /// Localization's noise is smoothed, forward and backward in time (BaseLocalizer). Where it
  /// jumped, it was wrong before: what came before is moved along, so that the track is one drive
  /// and ends where localization last saw it end.
  PoseTrack build(const std::string& map_frame, const std::string& odometry_frame,
                  std::int64_t odometry_shift = 0);

 private:
  using Sample = PoseTrack::Sample;

  std::vector<TrackSpan> findStands() const;
  std::vector<TrackJump> closeJumps();
  PlanarPose meanBase(std::size_t begin, std::size_t end, const PlanarPose& T_odom_base) const;
  PlanarPose odometryAt(Stamp stamp) const;
  PoseError measuredError() const;
  std::pair<PoseError, PoseError> smooth(const PoseError& measured);

  LocalizationNoise noise_;
  std::vector<Sample> poses_;        ///< poses in odom
  std::vector<Sample> corrections_;  ///< corrections of odom on the map
  std::int64_t pose_spacing_ = kSpacing, correction_spacing_ = kSpacing;
  static constexpr std::int64_t kSpacing = 20'000'000;
  Stamp last_heard_;
  PlanarPose last_pose_;
  std::vector<TrackSpan> gaps_;
  std::uint64_t out_of_order_ = 0;
};

}  // namespace afterglow::replay
