#include "nodes/calibrator/calibrator_topics.hpp"

#include <geometry_msgs/TransformStamped.h>
#include <sensor_msgs/CameraInfo.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "nodes/conversion/camera_messages.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/diagnostics.hpp"

namespace afterglow::nodes {
namespace {

double rounded(double value, double step) { return std::round(value / step) * step; }

nlohmann::json document(const CalibratorState& state) {
  nlohmann::json json = {{"phase", state.phase},
                         {"problem", state.problem},
                         {"doing", state.doing},
                         {"views", state.views},
                         {"views_wanted", state.views_wanted},
                         {"discarded", state.discarded},
                         {"coverage", rounded(state.coverage, 0.001)}};
  if (state.held_out_mm) json["held_out_mm"] = *state.held_out_mm;
  if (state.check_mm) json["check_mm"] = *state.check_mm;
  if (state.delay_ms) json["delay_ms"] = rounded(*state.delay_ms, 0.1);
  return json;
}

std_msgs::String stringMessage(const std::string& text) {
  std_msgs::String message;
  message.data = text;
  return message;
}

}  // namespace

std::string toJson(const CalibratorState& state) {
  nlohmann::json json = document(state);
  json["lit"] = state.lit;
  return json.dump();
}

diagnostic_msgs::DiagnosticArray toDiagnostics(const CalibratorState& state,
                                               const std::string& node) {
  using diagnostic_msgs::DiagnosticStatus;
  DiagnosticStatus status;
  status.name = node + ": calibration";
  status.hardware_id = "projector";
  status.level = state.problem.empty() ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
  status.message = state.problem.empty() ? state.phase : state.problem;
  const nlohmann::json values = document(state);
  for (const auto& [key, value] : values.items()) {
    addValue(status, key, value.is_string() ? value.get<std::string>() : value.dump());
  }
  diagnostic_msgs::DiagnosticArray array;
  array.status.push_back(status);
  return array;
}

CalibratorTopics::CalibratorTopics(bool is_spoken, bool publishes_transform)
    : is_spoken_(is_spoken) {
  guidance_ = own_.advertise<std_msgs::String>("guidance", 20, true);
  status_ = own_.advertise<std_msgs::String>("status", 20, true);
  if (is_spoken_) sound_ = nh_.advertise<sound_play::SoundRequest>("robotsound", 20);
  camera_info_ = own_.advertise<sensor_msgs::CameraInfo>("camera_info", 1, true);
  diagnostics_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 2);
  if (publishes_transform) transforms_.emplace();
  diagnostics_timer_ = nh_.createWallTimer(
      ros::WallDuration(1), [this](const ros::WallTimerEvent&) { publishDiagnostics(); });
}

void CalibratorTopics::say(const calib::Utterance& utterance, const std::string& progress) {
  const std::string written =
      utterance.is_advice ? utterance.text + " (" + progress + ")" : utterance.text;
  guidance_.publish(stringMessage(written));
  ROS_INFO("%s", written.c_str());
  if (!is_spoken_ || !utterance.is_spoken) return;
  sound_play::SoundRequest request;
  request.sound = sound_play::SoundRequest::SAY;
  request.command = sound_play::SoundRequest::PLAY_ONCE;
  request.volume = 1;
  request.arg = utterance.text;
  sound_.publish(request);
}

void CalibratorTopics::complain(const std::string& problem) {
  if (problem == last_problem_) return;
  last_problem_ = problem;
  if (problem.empty()) return;
  guidance_.publish(stringMessage(problem));
  ROS_WARN("%s", problem.c_str());
}

void CalibratorTopics::show(const CalibratorState& state) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state_ = state;
  }
  const std::string json = toJson(state);
  if (json == last_status_) return;
  last_status_ = json;
  status_.publish(stringMessage(json));
}

void CalibratorTopics::publishDiagnostics() {
  CalibratorState state;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state = state_;
  }
  diagnostic_msgs::DiagnosticArray array =
      toDiagnostics(state, ros::this_node::getName().substr(1));
  array.header.stamp = ros::Time::now();
  diagnostics_.publish(array);
}

void CalibratorTopics::publishCalibration(const calib::ProjectorEstimate& estimate,
                                          const calib::CalibrationNames& names) {
  sensor_msgs::CameraInfo info = toCameraInfo(estimate.projector);
  info.header.stamp = ros::Time::now();
  info.header.frame_id = names.projector_frame;
  camera_info_.publish(info);
  if (!transforms_) return;
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = ros::Time::now();
  transform.header.frame_id = names.camera_frame;
  transform.child_frame_id = names.projector_frame;
  transform.transform = toTransform(estimate.T_camera_projector.matrix());
  transforms_->sendTransform(transform);
}

}  // namespace afterglow::nodes
