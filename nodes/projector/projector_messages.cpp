#include "nodes/projector/projector_messages.hpp"

#include <fmt/format.h>
#include <sensor_msgs/image_encodings.h>

#include <utility>

#include "nodes/tools/diagnostics.hpp"

namespace afterglow::nodes {
namespace {

using diagnostic_msgs::DiagnosticStatus;

DiagnosticStatus projectorStatus(const ProjectorState& state, const OutputState& output) {
  DiagnosticStatus status;
  status.name = state.name + ": projector" + (output.name.empty() ? "" : " " + output.name);
  status.hardware_id = "projector";
  // Problems of the projector itself come first and keep it dark.
  const bool is_dark =
      !output.problems.empty() && output.problems.front().rfind("projector:", 0) == 0;
  status.level = is_dark                   ? DiagnosticStatus::ERROR
                 : output.problems.empty() ? DiagnosticStatus::OK
                                           : DiagnosticStatus::WARN;
  status.message = output.problems.empty() ? "projecting" : output.problems.front();
  addValue(status, "drawn_hz", fmt::format("{:.1f}", state.drawn_hz));
  addValue(status, "wanted_hz", fmt::format("{:.1f}", state.wanted_hz));
  addValue(status, "late", std::to_string(state.late));
  addValue(status, "renderer", output.renderer);
  for (const std::string& problem : output.problems) addValue(status, "problem", problem);
  return status;
}

DiagnosticStatus layerStatus(const std::string& node, const LayerStatus& layer) {
  DiagnosticStatus status;
  status.name = node + ": " + layer.topic;
  status.hardware_id = "projector";
  status.level = layer.dropped.empty() && layer.waiting_for.empty() ? DiagnosticStatus::OK
                                                                    : DiagnosticStatus::WARN;
  status.message = std::to_string(layer.shown) + " shown";
  if (!layer.waiting_for.empty()) status.message += ", waiting for frame " + layer.waiting_for;
  if (!layer.dropped.empty()) status.message += ", some dropped";
  addValue(status, "received", std::to_string(layer.received));
  addValue(status, "shown", std::to_string(layer.shown));
  addValue(status, "waiting", std::to_string(layer.waiting));
  for (const auto& [reason, count] : layer.dropped) {
    addValue(status, "dropped: " + reason, std::to_string(count));
  }
  for (const auto& [reason, count] : layer.remarks) {
    addValue(status, "remark: " + reason, std::to_string(count));
  }
  return status;
}

}  // namespace

sensor_msgs::Image toImage(render::Image image) {
  sensor_msgs::Image message;
  message.width = static_cast<std::uint32_t>(image.width);
  message.height = static_cast<std::uint32_t>(image.height);
  message.step = 3 * message.width;
  message.encoding = sensor_msgs::image_encodings::RGB8;
  message.data = std::move(image.rgb);
  return message;
}

sensor_msgs::CameraInfo toCameraInfo(const calib::Lens& lens) {
  sensor_msgs::CameraInfo message;
  message.width = static_cast<std::uint32_t>(lens.width);
  message.height = static_cast<std::uint32_t>(lens.height);
  message.distortion_model = calib::distortionModel(lens);
  message.D = calib::distortionCoefficients(lens);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const auto at = static_cast<std::size_t>(row);
      const auto on = static_cast<std::size_t>(column);
      message.K[3 * at + on] = lens.K(row, column);
      message.P[4 * at + on] = lens.K(row, column);
      message.R[3 * at + on] = row == column ? 1 : 0;
    }
  }
  return message;
}

diagnostic_msgs::DiagnosticArray toDiagnostics(const ProjectorState& state) {
  diagnostic_msgs::DiagnosticArray array;
  for (const OutputState& output : state.outputs) {
    array.status.push_back(projectorStatus(state, output));
  }
  for (const LayerStatus& layer : state.layers) {
    array.status.push_back(layerStatus(state.name, layer));
  }
  return array;
}

}  // namespace afterglow::nodes
