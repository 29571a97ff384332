/// \file
/// Looks at known tags on the floor from time to time, and compares where they are with where tf
/// and the camera's lens put them.
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2/buffer_core.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "calib/detection/tag_detector.hpp"
#include "calib/lens.hpp"
#include "nodes/projector/watch_config.hpp"
#include "nodes/projector/watch_status.hpp"

namespace afterglow::nodes {

/// From construction to destruction a thread of its own, of low priority and with a callback queue
/// of its own: it subscribes to the camera for one picture a period, and costs nothing in between.
class DriftWatch {
 public:
  /// The buffer is filled by somebody else and outlives this. Throws std::runtime_error if the
  /// camera_info is a file that cannot be read.
  DriftWatch(const WatchConfig& config, const tf2::BufferCore& transforms);
  ~DriftWatch();
  DriftWatch(const DriftWatch&) = delete;
  DriftWatch& operator=(const DriftWatch&) = delete;

  /// Of the newest look; safe from any thread, never waits for one.
  diagnostic_msgs::DiagnosticStatus status(const std::string& node) const;

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  WatchLook look();
  /// Sets image_ and, where it is a topic, camera_; says what did not come, or nothing.
  std::string waitForCamera();
  /// T_camera_surface at the picture's time, waiting a little for tf; empty if it does not come.
  std::optional<Rigid<Camera, Surface>> cameraPose(const std_msgs::Header& header) const;
  bool sleepUntil(Clock::time_point when) const;

  const WatchConfig config_;
  const tf2::BufferCore& transforms_;
  // Of the thread alone:
  calib::TagDetector detector_;
  std::optional<calib::Lens> camera_;
  sensor_msgs::CameraInfoConstPtr camera_info_;
  sensor_msgs::ImageConstPtr image_;
  ros::CallbackQueue queue_;
  ros::NodeHandle nh_;

  mutable std::mutex mutex_;  ///< newest_, looked_at_, is_stopping_
  mutable std::condition_variable stopping_;
  WatchLook newest_;
  Clock::time_point looked_at_;
  bool is_stopping_ = false;
  std::thread thread_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
