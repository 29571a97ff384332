/// \file
/// projector_node: the configured topics as the pictures that projectors have to show, live.
///
/// Publishes ~image (sensor_msgs/Image rgb8, as it is sent to the projector; stamp = the time it is
/// drawn for, frame = the projector's optical frame), ~camera_info beside each image (of a picture
/// that is sent mirrored: with negative focal lengths), /diagnostics once a second. Of several
/// projectors: ~NAME/image and ~NAME/camera_info each.
/// Service ~find_surfaces (std_srvs/Trigger): finds in the next clouds the surfaces that are to be
/// found, and keeps them until it is called again.
/// Parameters: ~config, ~calibration (folder of the lens's file; empty: the configuration's),
/// ~rate (Hz, 30), ~window (auto, true, false), ~monitor (of the only projector: connector, model
/// or index; comes before its `monitor` in the configuration).
#pragma once

#include <ros/ros.h>
#include <tf2/buffer_core.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "nodes/projector/drift_watch.hpp"
#include "nodes/projector/fault_log.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/projector/projector_messages.hpp"
#include "nodes/projector/projector_output.hpp"
#include "nodes/projector/projector_scene.hpp"
#include "nodes/projector/surface_service.hpp"
#include "nodes/projector/transform_inbox.hpp"
#include "nodes/tools/window_choice.hpp"
#include "render/gl/gl_context.hpp"

namespace afterglow::nodes {

struct ProjectorNodeOptions {
  std::string config;
  std::string calibration;
  double rate_hz =
      30;  ///< what moves is drawn so often; what arrives at once, up to twice so often
  WindowChoice window;

  /// Throws std::runtime_error naming the parameter that is missing or wrong.
  static ProjectorNodeOptions read(const ros::NodeHandle& own);
};

/// From construction to stop() it subscribes, draws one scene for every projector in a thread of
/// its own, publishes, and lays pictures out for whoever has windows. Callbacks come from the
/// caller's spinner.
class ProjectorNode {
 public:
  /// Throws std::runtime_error: configuration, lens or OpenGL, and why.
  explicit ProjectorNode(const ProjectorNodeOptions& options);
  ~ProjectorNode();

  /// Stops drawing; the last pictures, published here, are black.
  void stop();
  /// Returns when there are new pictures to be taken, or after so long.
  void awaitPictures(std::chrono::milliseconds patience);
  /// One a projector of the configuration, in its order; as long as the node.
  const std::vector<std::unique_ptr<ProjectorOutput>>& outputs() const { return outputs_; }
  /// Why drawing has ended before stop(), or empty.
  std::string failure() const;

 private:
  template <typename MessageType>
  ros::Subscriber subscribe(std::size_t layer);
  void subscribeAll();
  void startDrawing();
  void endDrawing();
  void drawInThread(std::promise<void>& started);
  void drawLoop();
  void drawAll();
  /// Until new content or the next regular picture is due, or the end.
  void awaitDue(std::chrono::steady_clock::time_point drawn_at);
  /// ROS time; clears the scene when it has jumped back. With the mutex held.
  ros::Time timeInOrder();
  void publishDiagnostics();
  void logFaults(const ProjectorState& state);

  ProjectorNodeOptions options_;
  tf2::BufferCore transforms_;
  mutable std::mutex mutex_;  ///< scene_, what follows
  ProjectorScene scene_;
  ros::Time last_time_;
  std::vector<std::vector<std::string>> problems_;  ///< of the last pictures, by projector
  std::string failure_;
  bool has_news_ = false;  ///< content that no picture shows
  std::chrono::steady_clock::time_point news_drawn_at_;
  bool has_pictures_ = false;  ///< for awaitPictures()
  std::condition_variable woken_, pictures_ready_;

  ros::NodeHandle nh_, own_{"~"};
  TransformInbox inbox_{transforms_};
  std::vector<std::unique_ptr<ProjectorOutput>> outputs_;
  ros::Publisher diagnostics_publisher_;
  std::vector<ros::Subscriber> subscribers_;
  std::unique_ptr<DriftWatch> watch_;  ///< where one is configured
  std::unique_ptr<SurfaceService> surface_service_;
  ros::WallTimer diagnostics_timer_;
  FaultLog faults_;
  std::atomic<std::uint64_t> drawn_{0}, late_{0};
  std::uint64_t drawn_before_ = 0;
  std::chrono::steady_clock::time_point counted_at_;

  std::atomic<bool> is_stopping_{false};
  std::thread drawing_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
