#include "nodes/recorder/recorder_node.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "nodes/tools/diagnostics.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::nodes {

RecorderNode::RecorderNode(const RecorderNodeOptions& options)
    : options_(options.resolved()),
      store_(options_.store),
      space_(options_, store_),
      manager_(options_, store_, space_),
      behaviors_(node_, "record_behavior", manager_) {
  if (options_.mongodb_logger) {
    logger_ =
        std::make_unique<GoalRecorder<mongodb::MongoDBLoggerAction, MongoDBLoggerTranslation>>(
            node_, "mongodb_logger", manager_);
  }
  diagnostics_ = node_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 2);
  start_service_ = private_node_.advertiseService("start_recording", &RecorderNode::onStart, this);
  stop_service_ = private_node_.advertiseService("stop_recording", &RecorderNode::onStop, this);
  every(1.0, [this] { everySecond(); });
  every(0.1, [this] { manager_.lookAtClocks(); });
  every(options_.rescan_s, [this] {
    try {
      manager_.lookForTopics();
    } catch (const std::runtime_error& error) {
      ROS_WARN_STREAM_THROTTLE(10, "looking for new topics: " << error.what());
    }
  });
  every(60, [this] { space_.makeRoom(); });
}

void RecorderNode::every(double period_s, const std::function<void()>& work) {
  timers_.push_back(
      node_.createWallTimer(ros::WallDuration(period_s), [work](const auto&) { work(); }));
}

RecorderNode::~RecorderNode() { close(); }

void RecorderNode::close() {
  manager_.hurry();
  start_service_.shutdown();
  stop_service_.shutdown();
  for (ros::WallTimer& timer : timers_) timer.stop();
  behaviors_.finishJobs();
  if (logger_) {
    logger_->finishJobs();
  }
  manager_.interruptAll("the recorder was stopped");
}

std::string RecorderNode::sendRest() {
  const auto left = store_.finish();
  const std::size_t waiting = left ? left->unsent + left->refused : 0;
  if (waiting == 0) return "";
  return std::to_string(waiting) + (waiting == 1 ? " behavior has" : " behaviors have") +
         " not reached " + replay::storeUri(options_.store) + " and wait in " + left->path +
         ": the next recorder with this store sends what is there";
}

bool RecorderNode::onStart(StartRecording::Request& request, StartRecording::Response& response) {
  try {
    response.behavior_id = manager_.start(toRequest(request), {}, &response.message);
    response.success = true;
  } catch (const std::exception& error) {
    response.success = false;
    response.message = error.what();
  }
  return true;
}

bool RecorderNode::onStop(StopRecording::Request& request, StopRecording::Response& response) {
  const std::vector<std::int64_t> ids = manager_.runningIds();
  const std::int64_t id =
      request.behavior_id != 0 || ids.empty() ? request.behavior_id : ids.back();
  const std::optional<RecordingManager::Ended> ended =
      manager_.stop(id, request.outcome.empty() ? "stopped" : request.outcome);
  response.behavior_id = id;
  if (!ended) {
    response.success = false;
    response.message = id == 0 ? "nothing is being recorded"
                               : "behavior " + std::to_string(id) + " is not being recorded";
    return true;
  }
  response.success = ended->problem.empty();
  response.message = ended->problem;
  response.messages = ended->counts.stored;
  response.dropped = ended->counts.dropped;
  response.kept = ended->kept;
  response.silent_topics = ended->counts.silent_topics;
  response.remarks = ended->counts.remarks;
  return true;
}

void RecorderNode::everySecond() {
  manager_.watch();
  behaviors_.tell();
  if (logger_) {
    logger_->tell();
  }
  publishDiagnostics();
}

void RecorderNode::publishDiagnostics() {
  const ros::SteadyTime now = ros::SteadyTime::now();
  RecorderState state;
  state.node = ros::this_node::getName().substr(1);
  state.store = replay::storeUri(options_.store);
  state.server = store_.status();
  state.running = manager_.runningIds().size();
  state.named = manager_.namedCounts();
  state.load = manager_.load();
  state.load_before = load_before_;
  state.seconds = std::max(1e-3, (now - told_at_).toSec());
  state.queue_bytes = static_cast<std::size_t>(options_.queue_megabytes) << 20;
  state.disk = space_.disk();
  state.failure = manager_.failure();
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = ros::Time::now();
  array.status.push_back(toDiagnostics(state));
  const bool is_waiting =
      state.server && (!state.server->last_error.empty() || state.server->refused > 0);
  if (is_waiting) ROS_WARN_STREAM_THROTTLE(60, array.status.back().message);
  diagnostics_.publish(array);
  load_before_ = state.load;
  told_at_ = now;
}

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
