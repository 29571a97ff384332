/// \file
/// The topics of calibrator_node: words for the person who holds the board, its status and its
/// result.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/ros.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <mutex>
#include <optional>
#include <string>

#include "calib/guide/guide.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/solver/calibration.hpp"
#include "nodes/calibrator/calibration_session.hpp"

namespace afterglow::nodes {

/// Keys as the members; held_out_mm, check_mm and delay_ms only when known.
std::string toJson(const CalibratorState& state);

/// Makes one status: a warning while the camera has a problem.
diagnostic_msgs::DiagnosticArray toDiagnostics(const CalibratorState& state,
                                               const std::string& node);

/// Everything but what the constructor starts, /diagnostics once a second, in one thread at a time.
class CalibratorTopics {
 public:
  CalibratorTopics(bool is_spoken, bool publishes_transform);

  /// Written on ~guidance (std_msgs/String, latched; advice with the progress) and in the log,
  /// spoken by whoever listens to /robotsound.
  void say(const calib::Utterance& utterance, const std::string& progress);
  /// A problem, once for as long as it lasts.
  void complain(const std::string& problem);
  /// ~status (std_msgs/String holding JSON, latched), if it has changed; also what /diagnostics
  /// has from now on.
  void show(const CalibratorState& state);
  /// ~camera_info (latched) and, where that is wanted, the transform on /tf_static.
  void publishCalibration(const calib::ProjectorEstimate& estimate,
                          const calib::CalibrationNames& names);

 private:
  void publishDiagnostics();

  const bool is_spoken_;
  ros::NodeHandle nh_, own_{"~"};
  ros::Publisher guidance_, status_, sound_, camera_info_, diagnostics_;
  std::optional<tf2_ros::StaticTransformBroadcaster> transforms_;
  std::string last_status_, last_problem_;
  std::mutex mutex_;  ///< state_
  CalibratorState state_;
  ros::WallTimer diagnostics_timer_;
};

}  // namespace afterglow::nodes
