#include "replay/motion/milestones.hpp"

#include "replay/messages/document.hpp"
#include "replay/messages/field_edit.hpp"
#include "replay/motion/goal_remainder.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/store/store.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::replay {
namespace {

struct RecordedGoal {
  Stamp at;
  std::string id;
  std::optional<std::int64_t> duration_ns;  ///< duration of its trajectory
  std::optional<Milestone> end;
};

struct RecordedAction {
  std::string goal_topic;
  std::vector<RecordedGoal> goals;
  bool has_results = false;
};

std::optional<std::int64_t> trajectoryDuration(const Schema& schema, const Bytes& bytes) {
  Value document = decode(schema, bytes);
  const auto trajectory = trajectoryIn(document);
  if (!trajectory || trajectory->points->empty()) return std::nullopt;
  return timeFromStartNs(trajectory->points->back());
}

void addGoal(const Schema& schema, const Message& message, RecordedAction& action) {
  action.goals.push_back({message.received, stringAt(schema, message.bytes, "goal_id.id"),
                          trajectoryDuration(schema, message.bytes), std::nullopt});
}

/// The goal that a result is of; without a goal of that id: the oldest that was sent without one.
RecordedGoal* goalOf(const std::string& id, RecordedAction& action) {
  RecordedGoal* nameless = nullptr;
  for (RecordedGoal& goal : action.goals) {
    if (goal.end) continue;
    if (!id.empty() && goal.id == id) return &goal;
    if (!nameless && (goal.id.empty() || id.empty())) nameless = &goal;
  }
  return nameless;
}

void addResult(const Schema& schema, const Message& message, RecordedAction& action) {
  action.has_results = true;
  RecordedGoal* goal = goalOf(stringAt(schema, message.bytes, "status.goal_id.id"), action);
  const auto status = findField(schema, message.bytes, FieldPath::parse("status.status"));
  if (!goal || status.empty()) return;
  Milestone end{message.received, outcomeOf(message.bytes[status.front().offset])};
  const bool was_replaced = end.outcome == GoalOutcome::Failed && goal != &action.goals.back();
  end.is_awaited = end.outcome != GoalOutcome::Canceled && !was_replaced;
  goal->end = end;
}

/// control_msgs/FollowJointTrajectoryResult's names; others have codes of their own.
std::string errorName(const std::string& type, std::int32_t code) {
  constexpr const char* kNames[] = {"INVALID_GOAL", "INVALID_JOINTS", "OLD_HEADER_TIMESTAMP",
                                    "PATH_TOLERANCE_VIOLATED", "GOAL_TOLERANCE_VIOLATED"};
  const bool is_named =
      type == "control_msgs/FollowJointTrajectoryActionResult" && code < 0 && code >= -5;
  return is_named ? std::string(kNames[-code - 1]) + ", " + std::to_string(code)
                  : "error " + std::to_string(code);
}

/// Ends goals by their trajectories: of an action whose results are there a goal without a result
/// was under way at the recording's end.
void endByTrajectories(RecordedAction& action) {
  for (RecordedGoal& goal : action.goals) {
    if (!action.has_results && goal.duration_ns) {
      goal.end = Milestone{{goal.at.ns + *goal.duration_ns}, GoalOutcome::Succeeded, false, true};
    }
  }
}

}  // namespace

GoalOutcome outcomeOf(std::uint8_t goal_status) {
  switch (goal_status) {  // actionlib_msgs/GoalStatus
    case 3:               // SUCCEEDED
      return GoalOutcome::Succeeded;
    case 4:  // ABORTED
    case 5:  // REJECTED
    case 9:  // LOST
      return GoalOutcome::Failed;
    case 2:  // PREEMPTED
    case 8:  // RECALLED
      return GoalOutcome::Canceled;
    default:
      return GoalOutcome::Open;
  }
}

std::string GoalEnd::words() const {
  const std::string how = status == 4   ? "was aborted"
                          : status == 5 ? "was rejected"
                          : status == 9 ? "was lost"
                          : outcome() == GoalOutcome::Canceled ? "was canceled"
                                                               : "ended";
  return reason.empty() ? how : how + " (" + reason + ")";
}

std::pair<std::string, GoalEnd> readResult(const std::string& type, const std::string& definition,
                                           const Bytes& bytes) {
  constexpr std::size_t kLongest = 100;  // letters of a robot's own words
  const Schema schema = Schema::parse(type, definition);
  const Value result = decode(schema, bytes);
  const auto text = [&](const char* path) {
    const Value* value = findValue(result, path);
    const auto* words = value ? std::get_if<std::string>(value) : nullptr;
    return words ? words->substr(0, kLongest) : std::string();
  };
  const auto status = findField(schema, bytes, FieldPath::parse("status.status"));
  if (status.empty()) throw MessageError("no result of an action: " + type);
  const Value* code = findValue(result, "result.error_code");
  const auto* number = code ? std::get_if<std::int32_t>(code) : nullptr;
  const std::string said = text("result.error_string");
  std::string reason = number && *number != 0 ? errorName(type, *number) : "";
  for (const std::string& words : {said, text("status.text")}) {
    const bool is_new = !words.empty() && reason.find(words) == std::string::npos;
    if (is_new) reason += (reason.empty() ? "" : ": ") + words;
  }
  return {text("status.goal_id.id"), {bytes[status.front().offset], reason}};
}

Milestones Milestones::read(const Store& store, const PlayPlan& plan) {
  Milestones found;
  std::map<std::string, RecordedAction> actions;  // by the topics of goals and of results
  MessageRange range;
  for (const PlannedTopic& topic : plan.topics) {
    if (!topic.movesBody() || !isGoal(topic.channel)) continue;
    const std::string result = actionOf(topic.channel.topic) + "/result";
    actions[result].goal_topic = topic.channel.topic;
    range.topics.insert(range.topics.end(), {topic.channel.topic, result});
  }
  if (actions.empty()) return found;
  KnownChannels channels(store);
  const auto cursor = store.messages(plan.behavior, range);
  while (const auto message = cursor->next()) {
    try {
      const std::string& topic = channels.channel(message->channel).topic;
      const Schema& schema = channels.schema(message->channel);
      const auto action = actions.find(topic);
      action != actions.end() ? addResult(schema, *message, action->second)
                              : addGoal(schema, *message, actions.at(actionOf(topic) + "/result"));
    } catch (const MessageError&) {  // not sent either, or no result of an action
    }
  }
  for (auto& [result, action] : actions) {
    endByTrajectories(action);
    bool is_known = true;
    for (const RecordedGoal& goal : action.goals) {
      if (goal.end) found.ends_[{action.goal_topic, goal.at.ns}] = *goal.end;
      is_known = is_known && (goal.end || action.has_results);
    }
    if (!is_known) {
      found.notes.push_back("no results of the goals on " + action.goal_topic +
                            " were recorded: nothing waits for them");
    }
  }
  return found;
}

std::optional<Milestone> Milestones::of(const std::string& topic, Stamp recorded_at) const {
  const auto found = ends_.find({topic, recorded_at.ns});
  return found == ends_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace afterglow::replay
