#include "replay/motion/motion_watch.hpp"

#include <algorithm>

#include "replay/messages/field_edit.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/velocity.hpp"

namespace afterglow::replay {
namespace {

std::string stringAt(const Schema& schema, const Bytes& bytes, const char* path) {
  const auto spans = findField(schema, bytes, FieldPath::parse(path));
  return spans.empty() ? "" : readString(bytes, spans.front());
}

Schema schemaOf(const Channel& channel) { return Schema::parse(channel.type, channel.definition); }

}  // namespace

MotionWatch::MotionWatch(const PlayPlan& plan) {
  for (const PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed()) watch(topic);
  }
}

void MotionWatch::watch(const PlannedTopic& topic) {
  const Channel& channel = topic.output;
  const auto output = static_cast<std::uint32_t>(outputs_.size());
  if (isVelocity(channel)) {
    topics_[channel.topic] = {Kind::Twist, output};
    outputs_.push_back({channel, Bytes(schemaOf(channel).minimumSize(0))});
  } else if (isTrajectoryCommand(channel)) {
    topics_[channel.topic] = {Kind::Trajectory, output};
    outputs_.push_back({channel, Bytes(schemaOf(channel).minimumSize(0))});
  } else if (isGoal(channel)) {
    const Channel cancel = cancelChannel(channel);
    topics_[channel.topic] = {Kind::Goal, output};
    topics_[cancel.topic] = {Kind::Cancel, output};
    goals_.emplace(channel.topic, schemaOf(channel));
    outputs_.push_back({cancel, cancelMessage("")});
  }
}

MotionWatch::Change MotionWatch::sending(const Channel& channel, const Bytes& bytes) {
  Change change;
  const auto found = topics_.find(channel.topic);
  if (found == topics_.end()) {
    return change;
  }
  const auto [kind, output] = found->second;
  change.output = output;
  if (kind == Kind::Twist) {
    change.is_motion = !isZero(velocityOf(bytes));
    change.has_changed = setMoving(output, change.is_motion);
  } else if (kind == Kind::Goal) {
    change.is_motion = true;
    open_[stringAt(goals_.at(channel.topic), bytes, "goal_id.id")] = output;
    change.has_changed = setMoving(output, true);
  } else if (kind == Kind::Cancel) {
    change.has_changed =
        endGoals(output, stringAt(schemaOf(outputs_[output].channel), bytes, "id"));
  } else {
    const Bytes halt = haltedTrajectory(channel, bytes);
    change.is_motion = halt != bytes;
    change.has_changed = setMoving(output, change.is_motion);
    change.has_other_stop = halt != outputs_[output].stop;
    outputs_[output].stop = halt;
  }
  return change;
}

bool MotionWatch::goalEnded(const std::string& id) {
  const auto goal = open_.find(id);
  return goal != open_.end() && endGoals(goal->second, id);
}

/// An empty id ends all.
bool MotionWatch::endGoals(std::uint32_t output, const std::string& id) {
  for (auto goal = open_.begin(); goal != open_.end();) {
    const bool is_over = goal->second == output && (id.empty() || goal->first == id);
    goal = is_over ? open_.erase(goal) : std::next(goal);
  }
  return setMoving(
      output, std::any_of(open_.begin(), open_.end(),
                          [output = output](const auto& goal) { return goal.second == output; }));
}

bool MotionWatch::setMoving(std::uint32_t output, bool is_moving) {
  return is_moving ? moving_.insert(output).second : moving_.erase(output) > 0;
}

}  // namespace afterglow::replay
