/// \file
/// The newest pose of the base by odometry and localization, from /tf.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdint>
#include <functional>
#include <optional>

#include "replay/motion/base_tracker.hpp"
#include "replay/motion/track_reader.hpp"

namespace afterglow::nodes {

/// Listens while it lives, and reads when it is asked; one thread. The newest transforms as they
/// came, never interpolated: a controller must not wait for the next one. Each is one step: odom ->
/// base, map -> odom.
class BasePoses {
 public:
  explicit BasePoses(const replay::TrackFrames& frames);

  /// Stamps are in ROS time here: odometry's own, moved by the shortest delay seen, so that another
  /// machine's clock does no harm; localization's when it came, because it is dated ahead.
  replay::BaseInput look(replay::Stamp now);
  /// The same after waiting for both, or for odometry alone. Odometry has to be alive: without a
  /// second pose that is newer, and with one that is older than half a second, there is none.
  replay::BaseInput wait(bool for_localization, double patience_s,
                         const std::function<bool()>& is_stopped);

 private:
  void onTransforms(const ros::MessageEvent<tf2_msgs::TFMessage const>& event);
  void onOdometry(const geometry_msgs::TransformStamped& transform, replay::Stamp received);

  const replay::TrackFrames frames_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  std::optional<replay::StampedPose> T_odom_base_;  ///< by its own clock
  int odometry_count_ = 0;                          ///< of stamps that rose, up to 2
  std::optional<replay::StampedPose> T_map_odom_;
  std::int64_t delay_ns_ = 0;  ///< of odometry, the shortest; its clock's difference is in it
};

/// ros::Time::now(), by which BasePoses dates what it hears.
replay::Stamp stampNow();

}  // namespace afterglow::nodes
