#include "nodes/recorder/recorder_node.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>

#include <stdexcept>
#include <vector>

#include "nodes/recorder/recorder_status.hpp"

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

}  // namespace afterglow::nodes
