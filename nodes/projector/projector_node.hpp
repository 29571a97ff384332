/// \file
/// projector_node: the configured topics as the pictures that projectors have to show, live.
///
/// Publishes ~image (sensor_msgs/Image rgb8, as it is sent to the projector; stamp = the time it is
/// drawn for, frame = the projector's optical frame), ~camera_info beside each image (of a picture
/// that is sent mirrored: with negative focal lengths), /diagnostics once a second; for RViz,
/// latched, ~beam and ~surfaces (visualization_msgs/MarkerArray). Of several projectors:
/// ~NAME/image, ~NAME/camera_info and ~NAME/beam each.
/// Service ~find_surfaces (std_srvs/Trigger): finds in the next clouds the surfaces that are to be
/// found, and keeps them until it is called again.
/// Where the configuration says 'avoid', it reads robot_description.
/// Parameters: ~config, ~calibration (folder of the lens's file; empty: the configuration's),
/// ~rate (Hz, 30), ~beam_length (m, 3; 0: no ~beam), ~window (auto, true, false), ~monitor (of the
/// only projector: connector, model or index; comes before its `monitor` in the configuration).
#pragma once

#include <ros/ros.h>
#include <tf2/buffer_core.h>

#include <chrono>
#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "nodes/projector/drift_monitor.hpp"
#include "nodes/projector/light_avoidance.hpp"
#include "nodes/projector/picture_schedule.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/projector/projector_diagnostics.hpp"
#include "nodes/projector/projector_output.hpp"
#include "nodes/projector/projector_scene.hpp"
#include "nodes/projector/robot_surface.hpp"
#include "nodes/projector/stage_times.hpp"
#include "nodes/projector/surface_service.hpp"
#include "nodes/projector/topic_monitor.hpp"
#include "nodes/projector/transform_listener.hpp"
#include "nodes/tools/window_choice.hpp"
#include "render/gl/gl_context.hpp"
#include "render/light_blend.hpp"

namespace afterglow::nodes {

struct ProjectorNodeOptions {
  std::string config;
  std::string calibration;
  /// The rate at which moving content is drawn. New content is drawn at once, at most twice as
  /// often.
  double rate_hz = 30;
  double beam_m = 3;  ///< reach of the beam that RViz is shown; 0: no beam
  WindowChoice window;

  /// Throws std::runtime_error naming the parameter that is missing or wrong.
  static ProjectorNodeOptions read(const ros::NodeHandle& own);
};

/// Subscribes from construction to stop(), draws one scene for every projector in a thread of its
/// own, publishes the images, and keeps the newest ones for windows. Callbacks come from the
/// caller's spinner.
class ProjectorNode {
 public:
  /// Throws std::runtime_error: configuration, lens or OpenGL, and why.
  explicit ProjectorNode(const ProjectorNodeOptions& options);
  ~ProjectorNode();

  /// Stops drawing; the last pictures, published here, are black.
  void stop();
  /// Returns when there are new images for windows, or after so long.
  void awaitPictures(std::chrono::milliseconds patience);
  /// The outputs, one for each projector of the configuration, in its order; they live as long as
  /// the node.
  const std::vector<std::unique_ptr<ProjectorOutput>>& outputs() const { return outputs_; }
  /// Returns why drawing has ended before stop(), or empty.
  std::string failure() const;

 private:
  /// `take` takes a message and the time, with the mutex held.
  template <typename MessageType, typename Take>
  ros::Subscriber subscribe(const std::string& topic, std::uint32_t queue, const Take& take);
  template <typename MessageType>
  ros::Subscriber subscribeLayer(std::size_t layer, const std::string& topic);
  template <typename MessageType>
  ros::Subscriber subscribeAvoided(std::size_t source, const std::string& topic);
  void subscribeAll();
  void subscribeAvoided();
  /// Reads the robot that light avoids, as long as it is not known.
  void readRobot();
  void startDrawing();
  void endDrawing();
  void drawInThread(std::promise<void>& started);
  void drawLoop();
  void drawAll();
  /// Shares the light among the projectors that have a pose and a screen. Returns words on it, by
  /// projector.
  std::vector<std::string> blend(const render::Scene& scene,
                                 std::vector<std::optional<Rigid<Projector, World>>> poses);
  bool isWaiting() const;
  /// Records the age of a message, where it has a stamp of the past.
  template <typename MessageType>
  void timeArrival(const MessageType& message);
  /// ROS time; clears the scene when it has jumped back. With the mutex held.
  ros::Time timeInOrder();
  /// Adds the publishers of the layers' topics, as far as they are known.
  void addSources(std::vector<LayerStatus>& layers) const;
  /// Statuses of what light keeps off.
  std::vector<LayerStatus> avoidedSources() const;
  void publishDiagnostics();

  ProjectorNodeOptions options_;
  tf2::BufferCore transforms_;
  mutable std::mutex mutex_;  ///< scene_, what follows
  ProjectorScene scene_;
  std::optional<LightAvoidance> avoidance_;  ///< where the configuration says 'avoid'
  ros::Time last_time_;
  std::vector<std::vector<std::string>> problems_;  ///< problems of the last pictures, by projector
  std::vector<std::string> blending_;               ///< blend()'s words on the last pictures
  std::string failure_;
  bool has_pictures_ = false;  ///< flag for awaitPictures()
  std::condition_variable pictures_ready_;

  StageTimes times_;
  PictureSchedule schedule_;
  ros::NodeHandle own_{"~"};
  TransformListener listener_{transforms_};
  std::vector<std::unique_ptr<ProjectorOutput>> outputs_;
  std::unique_ptr<render::LightBlend> blend_;  ///< blend, where it is configured; for drawing_
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::Subscriber> avoided_subscribers_;  ///< by source of 'avoid'
  std::unique_ptr<RobotSurfaceReader> robot_reader_;  ///< where light avoids the robot
  ros::Subscriber command_subscriber_;   ///< of the base, where it is configured
  std::unique_ptr<DriftMonitor> watch_;  ///< watch, where one is configured
  std::unique_ptr<SurfaceService> surface_service_;
  ros::Publisher surfaces_publisher_;
  std::unique_ptr<TopicMonitor> topic_watch_;
  ProjectorDiagnostics diagnostics_;
  ros::WallTimer diagnostics_timer_;
  std::thread drawing_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
