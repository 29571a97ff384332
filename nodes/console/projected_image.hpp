/// \file
/// What the projector shows now, for /api/projected.
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/Image.h>

#include <chrono>
#include <mutex>
#include <string>

#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {

/// Any thread. Listens only while somebody asks: an image that nobody wants is not sent.
class ProjectedImage {
 public:
  static constexpr std::chrono::seconds kPatience{5};  ///< after the last question it is let go
  static constexpr std::chrono::seconds kFresh{2};

  explicit ProjectedImage(std::string topic);

  /// image/jpeg, or 503 with the reason.
  HttpResponse newest();

 private:
  using Time = std::chrono::steady_clock::time_point;
  void hear(const sensor_msgs::ImageConstPtr& image);
  void look();

  const std::string topic_;
  std::mutex mutex_;
  sensor_msgs::ImageConstPtr image_;
  Time heard_{}, asked_{};
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  ros::WallTimer timer_;
};

}  // namespace afterglow::nodes
