/// \file
/// The newest pose of the base by odometry and localization, from /tf.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <functional>
#include <optional>

#include "replay/clock/sender_clock.hpp"
#include "replay/motion/base/base_tracker.hpp"
#include "replay/motion/base/track_reader.hpp"

namespace afterglow::nodes {

/// Listens while it lives, and reads when it is asked; one thread. The newest transforms as they
/// came, never interpolated: a controller must not wait for the next one. Each is one step: odom ->
/// base, map -> odom.
class BasePoses {
 public:
  explicit BasePoses(const replay::TrackFrames& frames);
  BasePoses(const BasePoses&) = delete;
  BasePoses& operator=(const BasePoses&) = delete;

  /// `now`: stampNow(). Stamps are of that time here: odometry's own, moved by the shortest delay
  /// seen, so that neither another machine's clock nor one that is set does harm; localization's
  /// when it came, because it is dated ahead.
  replay::BaseInput look(replay::Stamp now);
  /// The same after waiting for both, or for odometry alone. Odometry has to be alive: without a
  /// second pose that is newer, and with one that is older than kMotionSilence, there is none.
  replay::BaseInput wait(bool for_localization, double patience_s,
                         const std::function<bool()>& is_stopped);

 private:
  void onTransforms(const ros::MessageEvent<tf2_msgs::TFMessage const>& event);
  void onOdometry(const geometry_msgs::TransformStamped& transform, replay::Stamp received);

  const replay::TrackFrames frames_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  std::optional<replay::StampedPose> T_odom_base_, T_map_odom_;
  replay::SenderClock odometry_clock_;
};

/// robotNow(), by which BasePoses dates what it hears: no wall clock, which may be set meanwhile,
/// and so no stamp for a message.
replay::Stamp stampNow();

}  // namespace afterglow::nodes
