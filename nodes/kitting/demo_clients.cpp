#include "nodes/kitting/demo_clients.hpp"

#include <afterglow/StopRecording.h>

#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>

#include "nodes/kitting/kitting_robot.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kAnswer = 15;   // seconds: recorder and player answer sooner or not at all
constexpr double kOverrun = 60;  // seconds that a replay may take longer than its recording

template <typename Client>
void waitForServer(Client& client, const std::string& who, double seconds) {
  if (!client.waitForServer(ros::Duration(seconds))) throw TaskError(who + " is not there");
}

/// Where a replay is, as it last said: it stands while it waits for the body.
class ReplayPosition {
 public:
  void hear(double position_s) {
    const std::lock_guard<std::mutex> lock(mutex_);
    position_s_ = position_s;
  }
  std::optional<double> last() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return position_s_;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<double> position_s_;
};

}  // namespace

DemoRecorder::DemoRecorder()
    : client_("record_behavior", false),
      stop_(node_.serviceClient<StopRecording>("/recorder_node/stop_recording")) {}

void DemoRecorder::waitUntilReady(double seconds) {
  waitForServer(client_, "recorder_node", seconds);
}

RecordBehaviorResult DemoRecorder::record(const DemoRecording& request,
                                            const std::function<void()>& behavior) {
  RecordBehaviorGoal goal;
  goal.name = request.name;
  goal.tree_path = request.tree_path;
  goal.topics = request.topics;
  // Shared: a last feedback may come when this function has returned.
  const auto id = std::make_shared<std::atomic<std::int64_t>>(0);
  client_.sendGoal(goal, {}, {}, [id](const RecordBehaviorFeedbackConstPtr& feedback) {
    *id = feedback->behavior_id;
  });
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(kAnswer);
  while (*id == 0) {
    if (client_.getState().isDone() || ros::WallTime::now() > deadline) {
      throw TaskError("recorder_node does not record '" + request.name +
                      "': " + client_.getState().getText());
    }
    sleepFor(0.01);
  }
  try {
    behavior();
  } catch (...) {
    const std::exception_ptr problem = std::current_exception();
    try {
      stop(*id, "failure");
    } catch (const TaskError&) {
      // What went wrong first is what people need to know.
    }
    std::rethrow_exception(problem);
  }
  stop(*id, "success");
  if (!client_.waitForResult(ros::Duration(kAnswer))) {
    throw TaskError("recorder_node did not finish '" + request.name + "'");
  }
  return *client_.getResult();
}

void DemoRecorder::stop(std::int64_t id, const std::string& outcome) {
  StopRecording call;
  call.request.behavior_id = id;
  call.request.outcome = outcome;
  if (!stop_.call(call) || !call.response.success) {
    throw TaskError("recorder_node did not stop recording: " + call.response.message);
  }
}

PlayerClient::PlayerClient() : client_("replay", false) {}

void PlayerClient::waitUntilReady(double seconds) {
  waitForServer(client_, "player_node", seconds);
}

ReplayResult PlayerClient::replay(const std::string& name, double duration_s,
                                  const std::function<void(double)>& on_position) {
  ReplayGoal goal;
  goal.behavior = name;
  const auto position = std::make_shared<ReplayPosition>();
  client_.sendGoal(goal, {}, {}, [position](const ReplayFeedbackConstPtr& feedback) {
    position->hear(feedback->position);
  });
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(duration_s + kOverrun);
  while (!client_.getState().isDone()) {
    if (ros::WallTime::now() > deadline) {
      client_.cancelGoal();
      throw TaskError("player_node did not finish '" + name + "'");
    }
    if (const auto last = position->last()) on_position(*last);
    sleepFor(0.02);
  }
  const ReplayResultConstPtr result = client_.getResult();
  if (!result || !result->completed) {
    throw TaskError("player_node did not replay '" + name +
                    "' to its end: " + client_.getState().getText());
  }
  return *result;
}

}  // namespace afterglow::nodes
