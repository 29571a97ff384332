/// \file
/// The newest pose of the base by odometry and localization, from /tf, and the newest scan of its
/// range finder, in the base's frame, without the robot's own parts.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/clock/clock.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/motion/base/base_tracker.hpp"
#include "replay/motion/base/obstacle_stop.hpp"
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

/// Listens while it lives, and reads when it is asked; one thread. Where the range finder sits is
/// asked of tf.
class LiveScan {
 public:
  /// `outline`: the base's; what is seen within it is the robot's own. None: it is not known.
  LiveScan(const std::string& topic, const std::string& base_frame,
           const std::optional<replay::Footprint>& outline, const replay::RobotNames& robot);

  /// Empty before the first. Dated by stampNow(), as old as the scan says that it is, but not in
  /// the future, for which the shortest lead ever seen is taken off.
  std::shared_ptr<const replay::FloorScan> look();
  /// Waits until it is known how often they come, at most 3 s. Returns why the base cannot be
  /// driven by them: "no scan comes on /base_scan"; empty if it can.
  std::string check(const std::function<bool()>& is_stopped);

 private:
  void onScan(const sensor_msgs::LaserScan& message);
  Eigen::Isometry3d poseOf(const std::string& frame) const;
  std::optional<replay::ScanMount> mountOf(const std::string& frame);
  std::vector<replay::OwnPart> ownParts() const;

  const std::string topic_, base_frame_;
  const std::optional<replay::Footprint> outline_;
  std::set<std::string> links_;  ///< frames of the links in the robot's description
  tf2_ros::Buffer tf_;
  tf2_ros::TransformListener tf_listener_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  double height_ = 0;          ///< m, of the range finder over the base's frame
  std::int64_t delay_ns_ = 0;  ///< the shortest, if it is negative: its clock is ahead
  replay::ClockStepDetector wall_clock_;
  std::string problem_;  ///< the reason why the newest message is no scan
  std::shared_ptr<const replay::FloorScan> scan_;
};

/// The names of the links in a URDF.
std::set<std::string> linkNames(const std::string& urdf);

}  // namespace afterglow::nodes
