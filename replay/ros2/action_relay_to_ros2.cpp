#include "replay/ros2/action_relay_to_ros2.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {
namespace {

/// A server that rejects goals does so at once; one that keeps a goal waiting has taken it.
constexpr int kQueuedTicks = kActionTicksPerSecond;
/// A server that heeds a cancel says so at once.
constexpr int kCancelTicks = kActionTicksPerSecond;
/// As long as servers of ROS 2 keep a result.
constexpr int kResultTicks = 10 * kActionTicksPerSecond;
/// Requests for one result, and cancels, that wait for their answers.
constexpr std::size_t kMostWaiting = 256;
constexpr std::size_t kMostGoals = 1000;

bool isRejection(GoalState state) {
  return state == GoalState::Rejected || state == GoalState::Recalled;
}

bool isCancel(GoalState state) {
  return state == GoalState::Preempting || state == GoalState::Recalling ||
         state == GoalState::Preempted || state == GoalState::Recalled;
}

}  // namespace

ActionRelayToRos2::ActionRelayToRos2(const ActionType& type, Outlets outlets)
    : type_(type), outlets_(std::move(outlets)) {}

template <typename Handler>
bool ActionRelayToRos2::guarded(const char* what, const Handler& handler) {
  try {
    handler();
    return true;
  } catch (const MessageError& error) {
    outlets_.tell(std::string(what) + ": " + error.what());
    return false;
  }
}

ActionRelayToRos2::Goal* ActionRelayToRos2::find(const GoalUuid& uuid) {
  const auto found = std::find_if(goals_.begin(), goals_.end(),
                                  [&](const Goal& goal) { return goal.uuid == uuid; });
  return found == goals_.end() ? nullptr : &*found;
}

ActionRelayToRos2::Goal* ActionRelayToRos2::find(const std::string& id) {
  const auto found = std::find_if(goals_.begin(), goals_.end(),
                                  [&](const Goal& goal) { return goal.id.id == id; });
  return found == goals_.end() ? nullptr : &*found;
}

bool ActionRelayToRos2::isBusy() const {
  return std::any_of(goals_.begin(), goals_.end(),
                     [](const Goal& goal) { return goal.is_ours && !goal.result; });
}

// ------------------------------------------------------------------------------- from ROS 2

void ActionRelayToRos2::onRequest(ActionService service, const RequestId& id, const Bytes& cdr,
                                  Stamp now) {
  if (service == ActionService::GetResult) {
    guarded("a request for a result", [&] { onResultRequest(id, cdr); });
  } else if (service == ActionService::CancelGoal) {
    guarded("a cancel of ROS 2", [&] { onCancel(id, cdr); });
  } else if (!guarded("a goal of ROS 2", [&] { onGoal(id, cdr, now); })) {
    outlets_.reply(ActionService::SendGoal, id, goalReply(false, {}));
  }
}

void ActionRelayToRos2::onGoal(const RequestId& id, const Bytes& cdr, Stamp now) {
  const auto [uuid, bytes] = type_.readGoalRequest(cdr);
  if (uuid == kNoGoal || find(uuid)) throw MessageError("its id is taken");
  if (goals_.size() >= kMostGoals) throw MessageError("too many have no end");
  Goal& goal = goals_.emplace_back();
  goal.uuid = uuid;
  goal.id = {now, goalIdOf(uuid)};
  goal.sent = id;
  goal.is_ours = true;
  outlets_.publish_on_ros1(ActionTopic::Goal, actionGoalMessage(now, {goal.id, bytes}));
}

void ActionRelayToRos2::onResultRequest(const RequestId& id, const Bytes& cdr) {
  Goal* const goal = find(readResultRequest(cdr));
  if (goal && !goal->result) {
    if (goal->asked.size() >= kMostWaiting) throw MessageError("too many wait for one result");
    return goal->asked.push_back(id);
  }
  constexpr std::int8_t kUnknown = 0;
  outlets_.reply(ActionService::GetResult, id,
                 goal ? *goal->result : type_.resultReply(kUnknown, type_.noResult()));
}

void ActionRelayToRos2::onCancel(const RequestId& id, const Bytes& cdr) {
  const GoalInfo info = readCancelRequest(cdr);
  const bool is_named = info.uuid != kNoGoal, has_stamp = info.stamp != Stamp{};
  const Goal* const named = is_named ? find(info.uuid) : nullptr;
  // Whatever is known here: no cancel is withheld from the robot.
  sendCancel({info.stamp, named ? named->id.id : is_named ? goalIdOf(info.uuid) : ""});
  Cancel cancel{id, {}, 0};
  for (const Goal& goal : goals_) {
    const bool is_meant =
        &goal == named || (has_stamp && goal.accepted <= info.stamp) || (!is_named && !has_stamp);
    if (is_meant && !goal.result && !goal.sent) cancel.goals.push_back(goal.uuid);
  }
  if (cancel.goals.empty()) {
    const CancelCode code = named      ? CancelCode::GoalHasEnded
                            : is_named ? CancelCode::UnknownGoal
                                       : CancelCode::Canceling;
    return outlets_.reply(ActionService::CancelGoal, id, cancelReply(code, {}));
  }
  if (cancels_.size() >= kMostWaiting) throw MessageError("too many wait");
  cancels_.push_back(std::move(cancel));
}

void ActionRelayToRos2::sendCancel(const ActionGoalId& cancel) {
  outlets_.publish_on_ros1(ActionTopic::Cancel, goalIdMessage(cancel));
}

// ------------------------------------------------------------------------------- from ROS 1

void ActionRelayToRos2::onStatus(const Bytes& ros1, Stamp now) {
  guarded("a status of ROS 1", [&] {
    const std::vector<ActionGoalStatus> list = readStatusListMessage(ros1);
    silence_ = 0;
    for (const ActionGoalStatus& told : list) onGoalStatus(told, now);
    for (Goal& goal : goals_) {
      const bool is_told = std::any_of(list.begin(), list.end(), [&](const ActionGoalStatus& told) {
        return told.goal.id == goal.id.id;
      });
      // A server that was started anew, as for clients of actionlib.
      if (!is_told && goal.is_listed && !goal.result) onGoalState(goal, GoalState::Lost, now);
    }
    answerCancels();
    publishStatus();
  });
}

void ActionRelayToRos2::onGoalStatus(const ActionGoalStatus& told, Stamp now) {
  Goal* goal = find(told.goal.id);
  if (!goal && isFinal(told.state)) return;
  if (!goal) {
    const auto uuid = goalUuidOf(told.goal.id);
    goal = &goals_.emplace_back();
    goal->uuid = uuid ? *uuid : outlets_.fresh_uuid();
    goal->id = told.goal;
    goal->accepted = told.goal.stamp;
  }
  goal->is_listed = true;
  if (!goal->result) onGoalState(*goal, told.state, now);
}

void ActionRelayToRos2::onGoalState(Goal& goal, GoalState state, Stamp now) {
  if (goal.sent && isRejection(state)) return reject(goal);
  if (goal.sent && state != GoalState::Pending) accept(goal, now);
  if (state == GoalState::Lost) {
    endGoal(goal, goal.final_state.value_or(state), type_.noResult());
  } else if (!isFinal(state)) {
    goal.state = state;
  } else if (!goal.final_state) {
    goal.final_state = state;
    goal.ticks = 0;
  }
}

void ActionRelayToRos2::accept(Goal& goal, Stamp now) {
  goal.accepted = now;
  outlets_.reply(ActionService::SendGoal, *goal.sent, goalReply(true, now));
  goal.sent.reset();
}

void ActionRelayToRos2::reject(Goal& goal) {
  outlets_.reply(ActionService::SendGoal, *goal.sent, goalReply(false, {}));
  goal.state = GoalState::Rejected;
  goal.result = type_.resultReply(ros2StatusOf(goal.state), type_.noResult());
}

void ActionRelayToRos2::onFeedback(const Bytes& ros1) {
  guarded("feedback of ROS 1", [&] {
    const auto [status, feedback] = readActionUpdate(ros1);
    const Goal* const goal = find(status.goal.id);
    if (!goal || goal->result) return;
    outlets_.publish_on_ros2(ActionTopic::Feedback, type_.feedbackMessage(goal->uuid, feedback));
  });
}

void ActionRelayToRos2::onResult(const Bytes& ros1, Stamp now) {
  guarded("a result of ROS 1", [&] {
    const auto update = readActionUpdate(ros1);
    const GoalState state = update.first.state;
    Goal* const goal = find(update.first.goal.id);
    if (!goal || goal->result || !isFinal(state)) return;
    onGoalState(*goal, state, now);
    if (goal->result) return;
    const auto end = [&] { endGoal(*goal, state, update.second); };
    if (!guarded("a result of ROS 1", end)) endGoal(*goal, state, type_.noResult());
    answerCancels();
    publishStatus();
  });
}

// ------------------------------------------------------------------------------------- ends

void ActionRelayToRos2::endGoal(Goal& goal, GoalState state, const Bytes& part) {
  goal.result = type_.resultReply(ros2StatusOf(state), part);
  goal.state = state == GoalState::Rejected ? GoalState::Aborted : state;  // it was accepted
  goal.ticks = 0;
  for (const RequestId& asked : goal.asked) {
    outlets_.reply(ActionService::GetResult, asked, *goal.result);
  }
  goal.asked.clear();
}

void ActionRelayToRos2::onServerGone(Stamp now) {
  if (std::any_of(goals_.begin(), goals_.end(), [](const Goal& goal) { return !goal.result; })) {
    outlets_.tell("the action's server in ROS 1 is gone");
  }
  endAll(now);
}

void ActionRelayToRos2::onBridgeEnds(Stamp now) {
  for (const Goal& goal : goals_) {
    if (goal.is_ours && !goal.result) sendCancel({{}, goal.id.id});
  }
  endAll(now);
}

void ActionRelayToRos2::endAll(Stamp now) {
  for (Goal& goal : goals_) {
    if (goal.result) continue;
    onGoalState(goal, goal.sent ? GoalState::Rejected : GoalState::Lost, now);
  }
  answerCancels();
  publishStatus();
}

void ActionRelayToRos2::tick(Stamp now) {
  silence_ = std::min(silence_ + 1, kEndedTicks + 1);
  for (Goal& goal : goals_) {
    ++goal.ticks;
    if (!goal.result) look(goal, now);
  }
  goals_.remove_if([](const Goal& goal) { return goal.result && goal.ticks > kResultTicks; });
  for (Cancel& cancel : cancels_) ++cancel.ticks;
  answerCancels();
  publishStatus();
}

void ActionRelayToRos2::look(Goal& goal, Stamp now) {
  if (goal.final_state && goal.ticks > kEndedTicks) {
    outlets_.tell("the server in ROS 1 gave no result");
    endGoal(goal, *goal.final_state, type_.noResult());
  } else if (goal.sent && goal.is_listed && goal.ticks > kQueuedTicks) {
    accept(goal, now);
  } else if (goal.sent && goal.ticks > kPatienceTicks) {
    outlets_.tell("the server in ROS 1 did not answer");
    sendCancel({{}, goal.id.id});  // its client takes it for rejected
    reject(goal);
  }
}

void ActionRelayToRos2::answerCancels() {
  cancels_.erase(std::remove_if(cancels_.begin(), cancels_.end(),
                                [&](const Cancel& cancel) { return answer(cancel); }),
                 cancels_.end());
}

bool ActionRelayToRos2::answer(const Cancel& cancel) {
  std::vector<GoalInfo> canceling;
  bool are_over = true, are_decided = true;
  for (const GoalUuid& uuid : cancel.goals) {
    const Goal* const goal = find(uuid);
    if (!goal) continue;
    const GoalState state = goal->final_state.value_or(goal->state);
    if (isCancel(state)) canceling.push_back({uuid, goal->accepted});
    are_over = are_over && isFinal(state);
    are_decided = are_decided && (isCancel(state) || isFinal(state));
  }
  if (!are_decided && cancel.ticks <= kCancelTicks) return false;
  const CancelCode code = !canceling.empty() ? CancelCode::Canceling
                          : are_over         ? CancelCode::GoalHasEnded
                                             : CancelCode::Rejected;
  outlets_.reply(ActionService::CancelGoal, cancel.id, cancelReply(code, canceling));
  return true;
}

void ActionRelayToRos2::publishStatus() {
  std::vector<Ros2GoalStatus> goals;
  for (const Goal& goal : goals_) {
    if (goal.sent || goal.state == GoalState::Rejected) continue;
    goals.push_back({{goal.uuid, goal.accepted}, ros2StatusOf(goal.state)});
  }
  Bytes list = statusList(goals);
  if (list == status_) return;
  status_ = std::move(list);
  outlets_.publish_on_ros2(ActionTopic::Status, status_);
}

}  // namespace afterglow::replay
