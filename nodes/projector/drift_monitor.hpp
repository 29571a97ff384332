/// \file
/// Looks at known tags on the floor from time to time, compares where they are with where tf and
/// the camera's lens put them, and tells it in /diagnostics.
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2/buffer_core.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <string>

#include "calib/detection/tag_detector.hpp"
#include "calib/lens.hpp"
#include "calib/verify/tag_layout.hpp"
#include "nodes/projector/watch_config.hpp"
#include "replay/clock/worker_thread.hpp"

namespace afterglow::nodes {

/// The findings of one look at the floor.
struct WatchLook {
  calib::Drift drift;
  std::string problem;  ///< the reason why nothing could be compared; else empty
};

/// OK; WARN with the median offset above a limit; STALE when there was nothing to compare, or no
/// known tag was seen. `age_s`: how long ago the look was.
diagnostic_msgs::DiagnosticStatus watchStatus(const std::string& node, const WatchConfig& config,
                                              const WatchLook& look, double age_s);

/// Runs in a thread of its own, of low priority and with a callback queue of its own. It subscribes
/// to the camera for one image a period, and costs nothing in between.
class DriftMonitor {
 public:
  /// The buffer is filled by somebody else and outlives this. Throws std::runtime_error if the
  /// camera_info is a file that cannot be read.
  DriftMonitor(const WatchConfig& config, const tf2::BufferCore& transforms);

  /// Returns the status of the newest look, without waiting for one; from any thread.
  diagnostic_msgs::DiagnosticStatus status(const std::string& node) const;

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  WatchLook look();
  /// Sets image_ and, if camera_info is a topic, camera_. Returns what did not come, or "".
  std::string waitForCamera();
  /// T_camera_surface at the image's time, waiting a little for tf; empty if tf does not know it.
  std::optional<Rigid<Camera, Surface>> cameraPose(const std_msgs::Header& header) const;

  const WatchConfig config_;
  const tf2::BufferCore& transforms_;
  // Of the thread alone:
  calib::TagDetector detector_;
  std::optional<calib::Lens> camera_;
  sensor_msgs::CameraInfoConstPtr camera_info_;
  sensor_msgs::ImageConstPtr image_;
  ros::CallbackQueue queue_;
  ros::NodeHandle nh_;

  mutable std::mutex mutex_;  ///< newest_, looked_at_
  WatchLook newest_;
  Clock::time_point looked_at_;
  replay::RepeatingThread thread_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
