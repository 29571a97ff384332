/// \file
/// calibrator_node: a projector calibrated live, by a person who holds a printed board in its
/// light.
///
/// Topics in: the camera's image and camera_info (parameters name them). Out: ~pattern
/// (sensor_msgs/Image mono8, latched: what the projector has to show), ~guidance (std_msgs/String,
/// latched), ~status (std_msgs/String, JSON, latched), ~camera_info (sensor_msgs/CameraInfo of the
/// projector, latched, once solved), /robotsound, /diagnostics, /tf_static if asked.
/// Services (std_srvs/Trigger): ~start (from anew), ~stop, ~take (a view now, be it still and new
/// or not), ~solve (with the views there are), ~discard_last.
#pragma once

#include <ros/ros.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/guide/board_watch.hpp"
#include "calib/guide/guide.hpp"
#include "calib/solver/solve.hpp"
#include "nodes/calibrator/calibrator_messages.hpp"
#include "nodes/calibrator/calibrator_options.hpp"
#include "nodes/calibrator/calibrator_voice.hpp"
#include "nodes/calibrator/camera_inbox.hpp"
#include "nodes/calibrator/pattern_screen.hpp"
#include "nodes/tools/calibration_folder.hpp"

namespace afterglow::nodes {

/// From construction to stop() it watches in a thread of its own; solving has another one.
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
  using Trigger = std_srvs::Trigger;
  struct Solution {
    std::optional<calib::Calibration> calibration;
    std::vector<std::string> reasons;  ///< why there is none
    std::vector<calib::Photographs> photographs;
  };

  void advertiseServices();
  bool onStart(Trigger::Request& request, Trigger::Response& response);
  bool onStop(Trigger::Request& request, Trigger::Response& response);
  bool onTake(Trigger::Request& request, Trigger::Response& response);
  bool onSolve(Trigger::Request& request, Trigger::Response& response);
  bool onDiscardLast(Trigger::Request& request, Trigger::Response& response);

  void watchLoop();
  void onFrame(CameraFrame frame);
  bool hasGuide(const CameraFrame& frame);
  void beginGuide(const calib::Lens& camera);
  void keep(calib::TakerAnswer::Keep kind, calib::Picture picture);
  void finishView(const Rigid<Camera, Surface>& T_camera_board);
  void finishCheck(const calib::View& view);
  void solveWhenDue();
  Solution solve(std::vector<calib::Photographs> photographs, const calib::Lens& camera);
  void takeSolution();
  void publishCalibration(const calib::Calibration& calibration);
  calib::CalibrationNames names() const;
  calib::ReportFacts facts() const;
  void showAndSay();
  CalibratorState state() const;  ///< with the mutex held
  void publishDiagnostics();

  const CalibratorOptions options_;
  const calib::Board board_;
  const calib::Pattern pattern_;
  const CalibrationFolder folder_;

  // The watching thread's own.
  std::optional<calib::Lens> camera_;
  std::optional<calib::BoardWatch> watch_;
  std::optional<calib::ViewReader> reader_;
  calib::Photographs pending_;
  std::string camera_frame_, picture_problem_;
  std::future<Solution> solving_;
  unsigned solving_session_ = 0;

  mutable std::mutex mutex_;  ///< all down to the next empty line
  std::optional<calib::Guide> guide_;
  std::vector<calib::Photographs> photographs_;
  std::optional<calib::Calibration> calibration_;
  calib::ErrorSummary check_;  ///< without corners before the check
  bool is_started_ = false;
  unsigned session_ = 0;  ///< counts starts: what belongs to an earlier one is dropped
  std::string problem_, progress_;

  std::mutex stop_mutex_;
  std::atomic<bool> is_stopping_{false};
  ros::NodeHandle nh_, own_{"~"};
  PatternScreen screen_;
  CalibratorVoice voice_;
  CameraInbox inbox_;
  ros::Publisher camera_info_, diagnostics_;
  std::optional<tf2_ros::StaticTransformBroadcaster> transforms_;
  std::vector<ros::ServiceServer> services_;
  ros::WallTimer diagnostics_timer_;
  std::thread watching_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
