/// \file
/// The base's pose track of a stored behavior, read from its recording's /tf.
#pragma once

#include <optional>
#include <string>

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

}  // namespace afterglow::replay
