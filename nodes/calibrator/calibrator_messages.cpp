#include "nodes/calibrator/calibrator_messages.hpp"

#include <ros/time.h>

#include <cmath>
#include <nlohmann/json.hpp>

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
  return json;
}

}  // namespace

std::string toJson(const CalibratorState& state) { return document(state).dump(); }

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
    diagnostic_msgs::KeyValue entry;
    entry.key = key;
    entry.value = value.is_string() ? value.get<std::string>() : value.dump();
    status.values.push_back(entry);
  }
  diagnostic_msgs::DiagnosticArray array;
  array.status.push_back(status);
  return array;
}

geometry_msgs::TransformStamped toTransform(const Rigid<Camera, Projector>& T_camera_projector,
                                            const std::string& camera_frame,
                                            const std::string& projector_frame) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = ros::Time::now();
  message.header.frame_id = camera_frame;
  message.child_frame_id = projector_frame;
  const Eigen::Vector3d t = T_camera_projector.matrix().translation();
  const Eigen::Quaterniond q(T_camera_projector.matrix().linear());
  message.transform.translation.x = t.x();
  message.transform.translation.y = t.y();
  message.transform.translation.z = t.z();
  message.transform.rotation.x = q.x();
  message.transform.rotation.y = q.y();
  message.transform.rotation.z = q.z();
  message.transform.rotation.w = q.w();
  return message;
}

}  // namespace afterglow::nodes
