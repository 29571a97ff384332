/// \file
/// projector_node: the configured topics as the picture a projector has to show, live.
///
/// Publishes ~image (sensor_msgs/Image rgb8, stamp = the time it is drawn for, frame = the
/// projector's optical frame), ~camera_info beside each image, /diagnostics once a second.
/// Parameters: ~config, ~calibration (folder of the lens's file; empty: the configuration's),
/// ~rate (Hz, 30), ~window (auto, true, false), ~monitor (index or name).
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <tf2/buffer_core.h>
#include <tf2_ros/transform_listener.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "calib/lens.hpp"
#include "nodes/projector/drift_watch.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/projector/projector_scene.hpp"
#include "nodes/tools/window_choice.hpp"
#include "render/gl/renderer.hpp"

namespace afterglow::nodes {

struct ProjectorNodeOptions {
  std::string config;
  std::string calibration;
  double rate_hz = 30;
  WindowChoice window;

  /// Throws std::runtime_error naming the parameter that is missing or wrong.
  static ProjectorNodeOptions read(const ros::NodeHandle& own);
};

/// From construction to stop() it subscribes, draws in a thread of its own, publishes, and hands
/// pictures to whoever has a window. Callbacks come from the caller's spinner.
class ProjectorNode {
 public:
  /// Throws std::runtime_error: configuration, lens or OpenGL, and why.
  explicit ProjectorNode(const ProjectorNodeOptions& options);
  ~ProjectorNode();

  /// Stops drawing; the last picture, published here, is black.
  void stop();
  /// The newest picture that has not been taken, waiting for one at most so long.
  std::optional<render::Image> takePicture(std::chrono::milliseconds patience);
  render::Image black() const;
  const calib::Lens& lens() const { return lens_; }
  /// Why drawing has ended before stop(), or empty.
  std::string failure() const;

 private:
  template <typename MessageType>
  ros::Subscriber subscribe(std::size_t layer, std::uint32_t queue);
  void subscribeAll();
  void startDrawing();
  void drawLoop(render::ProjectorRenderer& renderer);
  void drawOne(render::ProjectorRenderer& renderer);
  /// Sets the time the frame is of.
  SceneFrame composeFrame(ros::Time& now);
  /// ROS time; clears the scene when it has jumped back. With the mutex held.
  ros::Time timeInOrder();
  void publish(const render::Image& image, ros::Time drawn_for);
  void publishDiagnostics();

  ProjectorNodeOptions options_;
  calib::Lens lens_;
  tf2::BufferCore transforms_;
  mutable std::mutex mutex_;  ///< scene_, last_time_, problems_, failure_
  ProjectorScene scene_;
  ros::Time last_time_;
  std::vector<std::string> problems_;
  std::string failure_;
  std::string gl_description_;

  std::mutex picture_mutex_;
  std::condition_variable picture_ready_;
  std::optional<render::Image> picture_;
  render::Image used_picture_;  ///< one that nobody took; its memory is drawn into next

  ros::NodeHandle nh_, own_{"~"};
  tf2_ros::TransformListener listener_{transforms_};
  ros::Publisher image_publisher_, camera_info_publisher_, diagnostics_publisher_;
  std::vector<ros::Subscriber> subscribers_;
  std::unique_ptr<DriftWatch> watch_;  ///< where one is configured
  ros::WallTimer diagnostics_timer_;
  std::atomic<std::uint64_t> drawn_{0}, late_{0};
  std::uint64_t drawn_before_ = 0;
  std::chrono::steady_clock::time_point counted_at_;

  std::atomic<bool> is_stopping_{false};
  std::thread drawing_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
