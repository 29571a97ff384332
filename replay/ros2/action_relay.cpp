#include "replay/ros2/action_relay.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {
namespace {

constexpr std::size_t kMostEarly = 256;

/// Counts a tick of what came early, and forgets what nothing followed.
template <typename Early>
void forgetOld(std::vector<Early>& early) {
  for (Early& one : early) ++one.ticks;
  const auto is_old = [](const Early& one) { return one.ticks > kEndedTicks; };
  early.erase(std::remove_if(early.begin(), early.end(), is_old), early.end());
}

}  // namespace

ActionRelay::ActionRelay(const ActionType& type, Outlets outlets)
    : type_(type), outlets_(std::move(outlets)) {}

template <typename Handler>
void ActionRelay::guarded(const char* what, const Handler& handler) {
  try {
    handler();
  } catch (const MessageError& error) {
    outlets_.tell(std::string(what) + ": " + error.what());
  }
}

ActionRelay::Goal* ActionRelay::find(const GoalUuid& uuid) {
  const auto found = std::find_if(goals_.begin(), goals_.end(),
                                  [&](const Goal& goal) { return goal.uuid == uuid; });
  return found == goals_.end() ? nullptr : &*found;
}

ActionRelay::Goal* ActionRelay::find(const std::string& id) {
  const auto found = std::find_if(goals_.begin(), goals_.end(),
                                  [&](const Goal& goal) { return goal.status.goal.id == id; });
  return found == goals_.end() ? nullptr : &*found;
}

ActionRelay::Goal& ActionRelay::add(const GoalUuid& uuid, const ActionGoalId& id) {
  Goal& goal = goals_.emplace_back();
  goal.uuid = uuid;
  goal.status.goal = id;
  return goal;
}

RequestId ActionRelay::send(ActionService service, const Bytes& cdr) {
  const RequestId id = outlets_.request(service, cdr);
  own_writers_[static_cast<std::size_t>(service)] = id.writer;
  return id;
}

// ------------------------------------------------------------------------------- from ROS 1

void ActionRelay::onRos1Goal(const Bytes& ros1, Stamp now) {
  guarded("a goal of ROS 1", [&] { onOwnGoal(ros1, now); });
}

void ActionRelay::onOwnGoal(const Bytes& ros1, Stamp now) {
  ActionGoal sent = readActionGoal(ros1);
  if (sent.id.id.empty()) sent.id.id = goalIdOf(outlets_.fresh_uuid());
  if (find(sent.id.id)) return;
  const auto uuid = goalUuidOf(sent.id.id);
  Goal& goal = add(uuid ? *uuid : outlets_.fresh_uuid(), sent.id);
  goal.is_ours = goal.is_shown = true;
  if (isCanceledEarly(sent.id)) {
    return endGoal(goal, GoalState::Recalled, "a cancel came before it", type_.noResult(), now);
  }
  if (goal.status.goal.stamp == Stamp{}) goal.status.goal.stamp = now;
  try {
    goal.sent = send(ActionService::SendGoal, type_.goalRequest(goal.uuid, sent.goal));
  } catch (const MessageError& error) {
    return endGoal(goal, GoalState::Rejected, error.what(), type_.noResult(), now);
  }
  publishStatus(now);
}

bool ActionRelay::isCanceledEarly(const ActionGoalId& id) {
  if (id.stamp != Stamp{} && id.stamp <= last_cancel_) return true;
  return std::any_of(early_cancels_.begin(), early_cancels_.end(),
                     [&](const EarlyCancel& cancel) { return cancel.id == id.id; });
}

void ActionRelay::onRos1Cancel(const Bytes& ros1) {
  guarded("a cancel of ROS 1", [&] { onOwnCancel(readGoalId(ros1)); });
}

void ActionRelay::onOwnCancel(const ActionGoalId& cancel) {
  const bool has_stamp = cancel.stamp != Stamp{}, is_all = cancel.id.empty() && !has_stamp;
  bool is_known = cancel.id.empty();
  for (Goal& goal : goals_) {
    const bool is_named = goal.status.goal.id == cancel.id;
    is_known = is_known || is_named;
    const bool is_before = has_stamp && goal.status.goal.stamp <= cancel.stamp;
    if (goal.has_ended || !(is_all || is_named || is_before)) continue;
    // The server does not know a goal that it has not accepted.
    if (!goal.asked) {
      goal.is_to_cancel = true;
    } else if (!is_all) {
      sendCancel(goal.uuid);
    }
  }
  if (is_all) sendCancel(kNoGoal);
  if (!is_known && early_cancels_.size() < kMostEarly) {
    early_cancels_.push_back({cancel.id, 0});
  }
  last_cancel_ = std::max(last_cancel_, cancel.stamp);
}

void ActionRelay::sendCancel(const GoalUuid& uuid) {
  send(ActionService::CancelGoal, cancelRequest(uuid));
}

// ------------------------------------------------------------------------------- from ROS 2

void ActionRelay::onRequest(ActionService service, const RequestId& id, const Bytes& cdr,
                            Stamp now) {
  if (own_writers_[static_cast<std::size_t>(service)] == id.writer) return;
  if (service == ActionService::SendGoal) {
    guarded("another client's goal", [&] { onForeignGoal(id, cdr, now); });
  } else if (service == ActionService::CancelGoal) {
    guarded("another client's cancel", [&] { onForeignCancel(cdr); });
  }
}

void ActionRelay::onForeignGoal(const RequestId& id, const Bytes& cdr, Stamp now) {
  const auto [uuid, bytes] = type_.readGoalRequest(cdr);
  Goal* goal = find(uuid);
  if (goal && goal->is_shown) return;
  if (!goal) goal = &add(uuid, {now, goalIdOf(uuid)});
  goal->sent = id;
  goal->is_shown = true;
  outlets_.publish(ActionTopic::Goal, actionGoalMessage(now, {goal->status.goal, bytes}));
  publishStatus(now);
  const auto early = std::find_if(early_replies_.begin(), early_replies_.end(),
                                  [&](const EarlyReply& reply) { return reply.request == id; });
  if (early == early_replies_.end()) return;
  const EarlyReply reply = std::move(*early);
  early_replies_.erase(early);
  if (!goal->asked) onGoalReply(*goal, reply.cdr, now);
}

void ActionRelay::onForeignCancel(const Bytes& cdr) {
  const GoalInfo info = readCancelRequest(cdr);
  ActionGoalId cancel{info.stamp, ""};
  if (info.uuid != kNoGoal) {
    const Goal* goal = find(info.uuid);
    cancel.id = goal ? goal->status.goal.id : goalIdOf(info.uuid);
  }
  outlets_.publish(ActionTopic::Cancel, goalIdMessage(cancel));
}

void ActionRelay::onReply(ActionService service, const RequestId& request, const Bytes& cdr,
                          Stamp now) {
  if (service == ActionService::CancelGoal) {
    if (own_writers_[static_cast<std::size_t>(service)] != request.writer) return;
    return guarded("the reply to a cancel", [&] {
      if (readCancelReply(cdr) != CancelCode::Rejected) return;
      outlets_.tell("the server refuses to cancel a goal");
    });
  }
  const bool is_goal = service == ActionService::SendGoal;
  for (Goal& goal : goals_) {
    if (goal.has_ended ||
        !(is_goal ? !goal.asked && goal.sent == request : goal.asked == request)) {
      continue;
    }
    return guarded(is_goal ? "the reply to a goal" : "a result",
                   [&] { is_goal ? onGoalReply(goal, cdr, now) : onResultReply(goal, cdr, now); });
  }
  const bool is_own = own_writers_[static_cast<std::size_t>(service)] == request.writer;
  if (is_goal && !is_own && early_replies_.size() < kMostEarly) {
    early_replies_.push_back({request, cdr});
  }
}

void ActionRelay::onGoalReply(Goal& goal, const Bytes& cdr, Stamp now) {
  if (readIsAccepted(cdr)) return onAccepted(goal);
  endGoal(goal, GoalState::Rejected, "the server rejected the goal", type_.noResult(), now);
}

void ActionRelay::onAccepted(Goal& goal) {
  goal.ticks = 0;
  goal.asked = send(ActionService::GetResult, resultRequest(goal.uuid));
  if (goal.is_to_cancel) sendCancel(goal.uuid);
}

void ActionRelay::onResultReply(Goal& goal, const Bytes& cdr, Stamp now) {
  const auto [status, result] = type_.readResultReply(cdr);
  const auto state = goalStateOf(status);
  if (state && isFinal(*state)) return endGoal(goal, *state, "", result, now);
  endGoal(goal, GoalState::Aborted, "the server does not know the goal", type_.noResult(), now);
}

void ActionRelay::onFeedback(const Bytes& cdr, Stamp now) {
  guarded("feedback", [&] {
    const auto [uuid, feedback] = type_.readFeedback(cdr);
    const Goal* goal = find(uuid);
    if (!goal || goal->has_ended) return;
    outlets_.publish(ActionTopic::Feedback, actionUpdateMessage(now, goal->status, feedback));
  });
}

void ActionRelay::onStatus(const Bytes& cdr, Stamp now) {
  guarded("a status", [&] {
    for (const Ros2GoalStatus& told : readStatusList(cdr)) onGoalStatus(told);
    publishStatus(now);
  });
}

void ActionRelay::onGoalStatus(const Ros2GoalStatus& told) {
  const auto state = goalStateOf(told.status);
  if (!state) return;
  Goal* goal = find(told.goal.uuid);
  // What ended before the bridge came has no result here.
  if (!goal && isFinal(*state)) return;
  if (!goal) goal = &add(told.goal.uuid, {told.goal.stamp, goalIdOf(told.goal.uuid)});
  if (goal->has_ended) return;
  if (!goal->asked) onAccepted(*goal);
  if (!isFinal(*state)) {
    goal->status.state = *state;
  } else if (!goal->final_state) {
    goal->final_state = state;
    goal->ticks = 0;
  }
}

// ------------------------------------------------------------------------------------- ends

void ActionRelay::endGoal(Goal& goal, GoalState state, const std::string& text, const Bytes& result,
                          Stamp now) {
  goal.status.state = state;
  goal.status.text = text;
  goal.has_ended = true;
  goal.ticks = 0;
  outlets_.publish(ActionTopic::Result, actionUpdateMessage(now, goal.status, result));
  publishStatus(now);
}

void ActionRelay::onServerGone(Stamp now) {
  for (Goal& goal : goals_) {
    if (goal.has_ended) continue;
    endGoal(goal, GoalState::Aborted, "the action's server is gone", type_.noResult(), now);
  }
}

void ActionRelay::onBridgeEnds(Stamp now) {
  for (Goal& goal : goals_) {
    if (goal.has_ended || !goal.is_ours) continue;
    sendCancel(goal.uuid);
    endGoal(goal, GoalState::Aborted, "the bridge to ROS 2 ends", type_.noResult(), now);
  }
}

void ActionRelay::tick(Stamp now) {
  for (Goal& goal : goals_) {
    ++goal.ticks;
    endOverdue(goal, now);
  }
  goals_.remove_if([](const Goal& goal) { return goal.has_ended && goal.ticks > kEndedTicks; });
  forgetOld(early_cancels_);
  forgetOld(early_replies_);
  publishStatus(now);
}

void ActionRelay::endOverdue(Goal& goal, Stamp now) {
  if (goal.has_ended) return;
  if (goal.final_state && goal.ticks > kEndedTicks) {
    endGoal(goal, *goal.final_state, "the server gave no result", type_.noResult(), now);
  } else if (!goal.asked && goal.ticks > kPatienceTicks) {
    endGoal(goal, GoalState::Aborted, "the server did not answer", type_.noResult(), now);
  }
}

void ActionRelay::publishStatus(Stamp now) {
  std::vector<ActionGoalStatus> goals;
  for (const Goal& goal : goals_) goals.push_back(goal.status);
  outlets_.publish(ActionTopic::Status, statusListMessage(now, goals));
}

}  // namespace afterglow::replay
