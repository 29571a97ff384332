#include "replay/motion/motion_watch.hpp"

#include <algorithm>

#include "replay/messages/field_edit.hpp"
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
    topics_[channel.topic] = {Kind::Twist, output, {}};
    outputs_.push_back({channel, Bytes(schemaOf(channel).minimumSize(0))});
  } else if (isTrajectoryCommand(channel)) {
    topics_[channel.topic] = {Kind::Trajectory, output, {}};
    outputs_.push_back({channel, Bytes(schemaOf(channel).minimumSize(0))});
  } else if (isGoal(channel)) {
    const Channel cancel = cancelChannel(channel);
    topics_[channel.topic] = {Kind::Goal, output, {}};
    topics_[cancel.topic] = {Kind::Cancel, output, channel.topic};
    actions_.emplace(channel.topic, Action{schemaOf(channel), output});
    outputs_.push_back({cancel, cancelMessage("")});
  }
}

MotionWatch::Change MotionWatch::sending(const Channel& channel, const Bytes& bytes) {
  Change change;
  const auto found = topics_.find(channel.topic);
  if (found == topics_.end()) {
    return change;
  }
  const auto& [kind, output, goals] = found->second;
  change.output = output;
  if (kind == Kind::Twist) {
    change.is_motion = !isZero(velocityOf(bytes));
    change.has_changed = setMoving(output, change.is_motion);
  } else if (kind == Kind::Goal) {
    change.is_motion = true;
    goals_.open(channel.topic, stringAt(actions_.at(channel.topic).goal, bytes, "goal_id.id"));
    change.has_changed = lookAtGoals();
  } else if (kind == Kind::Cancel) {
    const std::string id = stringAt(schemaOf(outputs_[output].channel), bytes, "id");
    goals_.cancel(goals, id);
    change.has_changed = lookAtGoals();
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
  goals_.close(id);
  return lookAtGoals();
}

/// True if an action's goals have set it in motion, or have all ended.
bool MotionWatch::lookAtGoals() {
  bool has_changed = false;
  for (const auto& [topic, action] : actions_) {
    has_changed |= setMoving(action.output, goals_.isOpen(topic));
  }
  return has_changed;
}

bool MotionWatch::setMoving(std::uint32_t output, bool is_moving) {
  return is_moving ? moving_.insert(output).second : moving_.erase(output) > 0;
}

}  // namespace afterglow::replay
