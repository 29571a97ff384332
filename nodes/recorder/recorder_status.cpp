#include "nodes/recorder/recorder_status.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "nodes/tools/diagnostics.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

using diagnostic_msgs::DiagnosticStatus;
using Level = replay::DiskState::Level;

std::string rate(std::uint64_t now, std::uint64_t before, double seconds) {
  return fmt::format("{:.1f}", static_cast<double>(now - before) / seconds);
}

void judge(const RecorderState& state, DiagnosticStatus& status) {
  const std::uint64_t dropped = state.load.dropped - state.load_before.dropped;
  status.level = DiagnosticStatus::WARN;
  if (state.failure || state.disk.level == Level::Full) {
    status.level = DiagnosticStatus::ERROR;
    status.message = state.failure.value_or(state.disk.text);
  } else if (dropped > 0) {
    status.message = std::to_string(dropped) + " messages were dropped";
  } else if (state.load.queued_bytes > state.queue_bytes / 2) {
    status.message = "the store is slower than what comes in";
  } else if (state.disk.level == Level::Low) {
    status.message = state.disk.text;
  } else if (state.server && !state.server->last_error.empty()) {
    status.message = std::to_string(state.server->unsent) +
                     (state.server->unsent == 1 ? " behavior waits in " : " behaviors wait in ") +
                     state.server->path + ": " + state.server->last_error;
  } else if (state.server && state.server->refused > 0) {
    status.message = "the server refuses " + state.server->last_refusal + "; it waits in " +
                     state.server->path + " for the next recorder to try again";
  } else {
    status.level = DiagnosticStatus::OK;
    status.message =
        state.running == 0 ? "ready" : "recording " + replay::counted(state.running, "behavior");
  }
}

}  // namespace

DiagnosticStatus toDiagnostics(const RecorderState& state) {
  DiagnosticStatus status;
  status.name = state.node + ": recorder";
  status.hardware_id = "recorder";
  judge(state, status);
  const replay::RecorderLoad &now = state.load, &before = state.load_before;
  addValue(status, "behaviors", std::to_string(state.running));
  addValue(status, "messages_per_s", rate(now.messages, before.messages, state.seconds));
  addValue(status, "bytes_per_s", rate(now.bytes, before.bytes, state.seconds));
  addValue(status, "queued_bytes", std::to_string(now.queued_bytes));
  addValue(status, "queue_percent",
           std::to_string(now.queued_bytes * 100 / std::max<std::size_t>(1, state.queue_bytes)));
  addValue(status, "messages", std::to_string(now.messages));
  addValue(status, "dropped", std::to_string(now.dropped));
  addValue(status, "store", state.store);
  for (const auto& [name, count] : state.named) addValue(status, name, std::to_string(count));
  if (state.server) {
    addValue(status, "unsent_behaviors", std::to_string(state.server->unsent));
    addValue(status, "refused_behaviors", std::to_string(state.server->refused));
  }
  return status;
}

}  // namespace afterglow::nodes
