/// \file
/// The base's pose track of a stored behavior, read from its recording's /tf: odometry gives its
/// shape, localization its place.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/base/base_localizer.hpp"
#include "replay/motion/pose_track.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Names of tf frames, with or without a leading slash. odom -> base must be published in one step.
struct TrackFrames {
  std::string map = "map", odometry = "odom", base = "base_link";
  std::string topic = "/tf";
};

/// Reads the behavior's recording in the behavior's interval, or in `begin` to `end` of it.
/// Empty if no pose of the base was recorded: `why` then says what was, in a sentence. Without
/// localization (map -> odom) the track is the odometry's, and says so in its remarks. Poses are
/// taken at their own stamps, moved to the recorder's clock by the shortest delay seen; what is no
/// transform is left out and counted in the remarks. Where the base ended is also told by what
/// localization said in the 10 s after the end, as long as the base stood. Throws StoreError.
std::optional<PoseTrack> readPoseTrack(const Store& store, const Behavior& behavior,
                                       const TrackFrames& frames, const LocalizationNoise& noise,
                                       std::string& why, std::optional<Stamp> begin = {},
                                       std::optional<Stamp> end = {});

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
