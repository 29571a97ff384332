/// \file
/// calibrator_node: a projector calibrated live, by a person who holds a printed board in its
/// light.
///
/// Topics in: the camera's image and camera_info (parameters name them). Out: ~pattern
/// (sensor_msgs/Image mono8, latched: what the projector has to show), ~guidance (std_msgs/String,
/// latched), ~status (std_msgs/String, JSON, latched), ~camera_info (sensor_msgs/CameraInfo of the
/// projector, latched, once solved), /robotsound, /diagnostics, /tf_static if asked.
/// Services (std_srvs/Trigger): ~start (from the beginning), ~stop, ~take (a view now, even if the
/// board moves or was held so before), ~solve (with the views there are), ~discard_last.
#pragma once

#include <ros/ros.h>

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "calib/guide/view_builder.hpp"
#include "nodes/calibrator/background_solver.hpp"
#include "nodes/calibrator/calibration_session.hpp"
#include "nodes/calibrator/calibrator_options.hpp"
#include "nodes/calibrator/calibrator_topics.hpp"
#include "nodes/calibrator/camera_subscriber.hpp"
#include "nodes/calibrator/latency_measurement.hpp"
#include "nodes/calibrator/pattern_screen.hpp"
#include "nodes/tools/calibration_folder.hpp"
#include "replay/clock/worker_thread.hpp"

namespace afterglow::nodes {

/// Watches the camera from construction to stop() in a thread of its own; solving has another one.
/// Callbacks come from the caller's spinner.
class CalibratorNode {
 public:
  /// Throws std::runtime_error naming the file that is wrong.
  explicit CalibratorNode(const CalibratorOptions& options);
  ~CalibratorNode();

  /// Stops watching and solving; the last picture is black.
  void stop();
  PatternScreen& screen() { return screen_; }
  /// Said and shown like everything else.
  void tell(const std::string& text);

 private:
  CalibratorNode(const CalibratorOptions& options, const calib::Board& board,
                 const calib::Pattern& pattern);
  using Answer = CalibrationSession::Answer;
  void advertise(const char* service, std::function<Answer()> answer);

  void watch();
  void onImage(CameraImage image);
  /// Returns true if the camera's lens is known and of this image; begins the session if it waits
  /// for that.
  bool isUsable(const CameraImage& image);
  void finishView(const Rigid<Camera, Surface>& T_camera_board);
  void finishCheck(const calib::View& view);
  void startSolving();
  void takeSolution();
  /// Begins, or goes on with, the measurement of the delay; returns how long an image may be waited
  /// for.
  std::chrono::nanoseconds goOnTiming();
  void finishTiming();
  void showAndSay();

  const CalibratorOptions options_;
  const CalibrationFolder folder_;
  CalibrationSession session_;

  // The watching thread's own.
  std::optional<calib::ViewBuilder> views_;  ///< once the camera is known
  BackgroundSolver solver_;
  calib::ReportFacts facts_;
  std::optional<LatencyMeasurement> timing_;
  std::string image_problem_;  ///< empty: there is none

  std::mutex stop_mutex_;
  ros::NodeHandle own_{"~"};
  PatternScreen screen_;
  CalibratorTopics topics_;
  CameraSubscriber camera_;
  std::vector<ros::ServiceServer> services_;
  /// Last: it uses all of the above. camera_ sets its pace.
  replay::RepeatingThread watching_{std::chrono::nanoseconds(0), [this] { watch(); }};
};

}  // namespace afterglow::nodes
