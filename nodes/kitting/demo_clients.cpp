#include "nodes/kitting/demo_clients.hpp"

#include <afterglow/AskActionGoal.h>
#include <afterglow/StartRecording.h>
#include <fmt/format.h>

#include "replay/plan/rewrite.hpp"

namespace afterglow::nodes {

using actionlib_msgs::GoalStatus;

void sleepFor(double seconds) {
  if (seconds > 0) ros::Duration(seconds).sleep();
  if (!ros::ok()) throw TaskError("interrupted");
}

bool waitUntil(const std::function<bool()>& condition, double seconds) {
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(seconds);
  while (!condition()) {
    if (ros::WallTime::now() > deadline) return false;
    sleepFor(0.01);
  }
  return true;
}

ActionClient::ActionClient(std::string who, const std::string& action, const ros::Publisher& goals)
    : who_(std::move(who)),
      goals_(goals),
      fresh_id_(replay::uniqueGoalIds(ros::this_node::getName())),
      statuses_(
          ros::NodeHandle().subscribe(action + "/status", 20, &ActionClient::onStatus, this)) {}

bool ActionClient::isServed() const {
  return goals_.getNumSubscribers() > 0 && statuses_.getNumPublishers() > 0;
}

std::string ActionClient::begin() {
  const std::lock_guard<std::mutex> lock(mutex_);
  status_ = GoalStatus();
  return status_.goal_id.id = fresh_id_();
}

void ActionClient::onStatus(const actionlib_msgs::GoalStatusArray& statuses) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const GoalStatus& status : statuses.status_list) {
    if (status.goal_id.id == status_.goal_id.id) status_ = status;
  }
}

GoalStatus ActionClient::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return status_;
}

bool ActionClient::isOver() const {
  const std::uint8_t is = status().status;
  return is != GoalStatus::PENDING && is != GoalStatus::ACTIVE && is != GoalStatus::PREEMPTING &&
         is != GoalStatus::RECALLING;
}

void ActionClient::expectSuccess(double seconds) const {
  if (!waitUntil([this] { return isOver(); }, seconds)) {
    throw TaskError(fmt::format("{} did not finish within {:.1f} s", who_, seconds));
  }
  const GoalStatus is = status();
  if (is.status == GoalStatus::SUCCEEDED) return;
  throw TaskError(fmt::format("{} gave up (status {}): {}", who_, is.status, is.text));
}

namespace {

constexpr double kOverrun = 60;  // seconds that a replay may take longer than its recording

StopRecordingResponse stopRecording(std::int64_t id, const std::string& outcome) {
  StopRecording call;
  call.request.behavior_id = id;
  call.request.outcome = outcome;
  if (!ros::service::call("/recorder_node/stop_recording", call) || !call.response.success) {
    throw TaskError("recorder_node did not stop recording: " + call.response.message);
  }
  return call.response;
}

}  // namespace

StopRecordingResponse recordBehavior(const std::string& name,
                                     const std::vector<std::string>& topics,
                                     const std::function<void()>& behavior) {
  StartRecording call;
  call.request.name = name;
  call.request.tree_path = "kitting/" + name;
  call.request.topics = topics;
  if (!ros::service::call("/recorder_node/start_recording", call) || !call.response.success) {
    throw TaskError("recorder_node does not record '" + name + "': " + call.response.message);
  }
  try {
    behavior();
  } catch (const std::exception&) {
    try {
      stopRecording(call.response.behavior_id, "failure");
    } catch (const TaskError&) {
      // What went wrong first is what people need to know.
    }
    throw;
  }
  return stopRecording(call.response.behavior_id, "success");
}

AskClient::AskClient() : client_(ActionClient::of<AskActionGoal>("ask_node", "/ask")) {
  ros::NodeHandle node;
  feedback_ = node.subscribe<ReplayActionFeedback>(
      "/replay/feedback", 10, [this](const ReplayActionFeedbackConstPtr& feedback) {
        const std::lock_guard<std::mutex> lock(mutex_);
        position_s_ = feedback->feedback.position;
      });
  answers_ = node.subscribe<AskActionResult>(
      "/ask/result", 10, [this](const AskActionResultConstPtr& answer) {
        const std::lock_guard<std::mutex> lock(mutex_);
        answer_ = answer->result;
      });
  replays_ = node.subscribe<ReplayActionResult>(
      "/replay/result", 10, [this](const ReplayActionResultConstPtr& replay) {
        const std::lock_guard<std::mutex> lock(mutex_);
        replay_ = *replay;
      });
}

void AskClient::waitUntilReady(double seconds) {
  const auto is_asked = [this] { return client_.isServed() && answers_.getNumPublishers() > 0; };
  if (!waitUntil(is_asked, seconds)) throw TaskError("ask_node is not there");
  const auto is_played = [this] { return replays_.getNumPublishers() > 0; };
  if (!waitUntil(is_played, seconds)) throw TaskError("player_node is not there");
}

void AskClient::forget() {
  const std::lock_guard<std::mutex> lock(mutex_);
  position_s_.reset();
  answer_.reset();
  replay_.reset();
}

/// The answer and the replay's own result come from two nodes.
bool AskClient::isAnswered(const std::function<void(double)>& on_position) {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto position = position_s_;
  const bool is_answered = answer_ && (replay_ || answer_->answer != AskResult::REPLAYED);
  lock.unlock();
  if (position) on_position(*position);
  return is_answered;
}

ReplayResult AskClient::ask(const std::string& question, double duration_s,
                            const std::function<void(double)>& on_position) {
  forget();
  AskGoal goal;
  goal.question = question;
  client_.send<AskActionGoal>(goal);
  waitUntil([&] { return isAnswered(on_position); }, duration_s + kOverrun);
  client_.expectSuccess(1);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!answer_ || answer_->answer != AskResult::REPLAYED) {
    const std::string why = replay_ ? replay_->status.text : answer_ ? answer_->sentence : "";
    throw TaskError(fmt::format("'{}' was not answered by a replay: {}", question, why));
  }
  if (!answer_->moved) throw TaskError("'" + question + "' was answered without motion");
  if (!replay_ || !replay_->result.completed) {
    throw TaskError("player_node did not replay the answer to its end");
  }
  return replay_->result;
}

void expectAllNodes() {
  for (const char* node : {"/fake_fetch", "/projector_node", "/recorder_node", "/player_node",
                           "/ask_node", "/speaker_node"}) {
    // Every node of roscpp has this service.
    if (!ros::service::exists(std::string(node) + "/get_loggers", false)) {
      throw TaskError(std::string(node) + " is not there any more");
    }
  }
}

}  // namespace afterglow::nodes
