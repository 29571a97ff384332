/// \file
/// The newest image of a camera and its lens, from topics that may be missing, wrong or silent.
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "calib/latency/latency.hpp"
#include "calib/lens.hpp"
#include "calib/picture.hpp"

namespace afterglow::nodes {

struct CameraImage {
  calib::Picture picture;
  std::int64_t stamp_ns = 0;  ///< the header's; the time of arrival where that is zero
  std::string frame_id;
  calib::ClockReading arrived;
};

/// Callbacks come from the caller's spinner; everything else from any thread.
class CameraSubscriber {
 public:
  /// `lens`: known from a file, and `camera_info_topic` is not used; if empty, the topic tells it;
  /// without a topic nobody asks for the lens.
  CameraSubscriber(const std::string& image_topic, const std::string& camera_info_topic,
                   const std::optional<calib::Lens>& lens);

  /// The newest image that was not taken, waiting for one at most so long. Older ones are dropped.
  /// Empty also after a bad message: problem() tells.
  std::optional<CameraImage> take(std::chrono::nanoseconds patience);
  std::optional<calib::Lens> lens() const;
  /// Returns why there are no images or no lens, in one line; empty if there are.
  std::string problem() const;

 private:
  void onImage(const sensor_msgs::ImageConstPtr& message);
  void onCameraInfo(const sensor_msgs::CameraInfoConstPtr& message);

  const std::string image_topic_, camera_info_topic_;
  const std::chrono::steady_clock::time_point began_at_;
  mutable std::mutex mutex_;
  std::condition_variable image_came_;
  sensor_msgs::ImageConstPtr newest_;
  calib::ClockReading arrived_;  ///< of newest_
  std::optional<calib::Lens> lens_;
  std::string image_problem_, lens_problem_;
  std::chrono::steady_clock::time_point heard_at_;
  bool was_heard_ = false;
  ros::NodeHandle nh_;
  ros::Subscriber image_subscriber_, camera_info_subscriber_;
};

}  // namespace afterglow::nodes
