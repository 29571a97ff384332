#include "nodes/projector/projector_diagnostics.hpp"

#include <fmt/format.h>

#include <utility>

#include "nodes/tools/diagnostics.hpp"

namespace afterglow::nodes {
namespace {

using diagnostic_msgs::DiagnosticStatus;

const std::string kOwnProblem = "projector: ";  // of a projector, not of the whole scene

DiagnosticStatus projectorStatus(const ProjectorState& state, const OutputState& output) {
  DiagnosticStatus status;
  status.name = state.name + ": projector" + (output.name.empty() ? "" : " " + output.name);
  status.hardware_id = "projector";
  // Problems of the projector itself come first and keep it dark.
  const bool is_dark =
      !output.problems.empty() && output.problems.front().rfind(kOwnProblem, 0) == 0;
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

// ------------------------------------------------------------------------------------------ log
void FaultLog::add(std::vector<std::string>& lines, const std::string& prefix,
                   const std::map<std::string, std::uint64_t>& reasons, std::int64_t now_ns) {
  for (const auto& [reason, count] : reasons) {
    const std::string line = prefix + reason;
    const auto [said, is_new] = counted_.try_emplace(line, Said{0, now_ns});
    if (count <= said->second.count) continue;
    if (!is_new && now_ns - said->second.at_ns < kAgainNs) continue;
    const std::uint64_t since = count - said->second.count;
    lines.push_back(since == 1 ? line : line + " (" + std::to_string(since) + " times)");
    said->second = {count, now_ns};
  }
}

std::vector<std::string> FaultLog::news(const std::vector<std::string>& problems,
                                        const std::vector<LayerStatus>& layers,
                                        std::int64_t now_ns) {
  std::vector<std::string> lines;
  for (auto it = standing_.begin(); it != standing_.end();) {
    it = now_ns - it->second >= kAgainNs ? standing_.erase(it) : std::next(it);
  }
  for (const std::string& problem : problems) {
    if (standing_.try_emplace(problem, now_ns).second) lines.push_back(problem);
  }
  for (const LayerStatus& layer : layers) {
    add(lines, layer.topic + ": dropped: ", layer.dropped, now_ns);
    add(lines, layer.topic + ": shown, but odd: ", layer.remarks, now_ns);
  }
  return lines;
}

// ------------------------------------------------------------------------------------------ node
ProjectorDiagnostics::ProjectorDiagnostics(double wanted_hz)
    : wanted_hz_(wanted_hz), counted_at_(std::chrono::steady_clock::now()) {
  publisher_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 2);
}

void ProjectorDiagnostics::countImage(bool is_late) {
  ++drawn_;
  if (is_late) ++late_;
}

void ProjectorDiagnostics::publish(ProjectorState state,
                                   const std::optional<DiagnosticStatus>& watch) {
  const auto now = std::chrono::steady_clock::now();
  const std::uint64_t drawn = drawn_;
  state.name = ros::this_node::getName().substr(1);
  state.wanted_hz = wanted_hz_;
  state.drawn_hz = static_cast<double>(drawn - drawn_before_) /
                   std::chrono::duration<double>(now - counted_at_).count();
  state.late = late_;
  drawn_before_ = drawn;
  counted_at_ = now;
  log(state);
  diagnostic_msgs::DiagnosticArray array = toDiagnostics(state);
  if (watch) array.status.push_back(*watch);
  array.header.stamp = ros::Time::now();
  publisher_.publish(array);
}

void ProjectorDiagnostics::log(const ProjectorState& state) {
  std::vector<std::string> problems;
  for (const auto& [name, renderer, of_image] : state.outputs) {
    for (const std::string& problem : of_image) {
      const bool is_own = !name.empty() && problem.rfind(kOwnProblem, 0) == 0;
      problems.push_back(is_own ? "projector " + name + ": " + problem.substr(kOwnProblem.size())
                                : problem);
    }
  }
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  const std::int64_t now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  for (const std::string& line : faults_.news(problems, state.layers, now_ns)) {
    ROS_WARN("%s", line.c_str());
  }
}

}  // namespace afterglow::nodes
