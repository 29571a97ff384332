/// \file
/// /diagnostics in plain words: who is well, and what projector and recorder say of themselves.
///
/// The newest image of the projector or of a camera, for /api/projected and /api/camera.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/ros.h>
#include <sensor_msgs/Image.h>

#include <chrono>
#include <cstddef>
#include <mutex>
#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "nodes/console/http_message.hpp"
#include "nodes/tools/diagnostics.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// Any thread.
class HeardDiagnostics {
 public:
  static constexpr std::size_t kMost = 200;  ///< names; further ones are not looked at
  static constexpr std::chrono::seconds kFresh{5}, kKept{60};

  HeardDiagnostics();

  /// [{"name", "level": 0 to 3, "words"}]; level 3: not heard for kFresh.
  nlohmann::ordered_json all() const;
  /// {"words", "level": the worst, "layers": [{"topic", "hz", "shown", "words"}]}
  nlohmann::ordered_json projector() const;
  /// {"words", "recording", "dropped", ...}; {}: none is heard.
  nlohmann::ordered_json recorder() const;

 private:
  void hear(const diagnostic_msgs::DiagnosticArray& array);

  mutable std::mutex mutex_;
  HeardStatuses statuses_{kMost};
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
};

/// Any thread. Listens only while somebody asks: an image that nobody wants is not sent.
class ProjectedImage {
 public:
  static constexpr std::chrono::seconds kPatience{5};  ///< since the last question
  static constexpr std::chrono::seconds kFresh{2};

  explicit ProjectedImage(const std::string& topic);

  /// {topic, published}: whether another node publishes it, as of the last second, so that pages
  /// ask only then.
  nlohmann::ordered_json state() const;
  /// image/jpeg; 204 while the first one is awaited; else 503 with the reason.
  HttpResponse newest();

 private:
  using Time = std::chrono::steady_clock::time_point;
  void hear(const sensor_msgs::ImageConstPtr& image);
  void look();

  const std::string topic_;
  MasterLink master_;  ///< the timer's
  mutable std::mutex mutex_;  ///< all below
  bool is_published_ = false;
  sensor_msgs::ImageConstPtr image_;
  Time heard_{}, asked_{}, subscribed_{};
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  ros::WallTimer timer_;
};

}  // namespace afterglow::nodes
