#include "replay/motion/stops/motion_monitor.hpp"

#include <cmath>
#include <utility>

#include "replay/messages/field_edit.hpp"
#include "replay/motion/arm/start_pose.hpp"

namespace afterglow::replay {
namespace {

/// actionlib_msgs/GoalID: the id behind the stamp.
std::string canceledId(const Bytes& cancel) {
  constexpr std::size_t kStamp = 8, kLength = 4;
  return cancel.size() < kStamp + kLength
             ? ""
             : readString(cancel, {FieldType::String, kStamp, cancel.size() - kStamp});
}

}  // namespace

MotionMonitor::MotionMonitor(const PlayPlan& plan) {
  for (const PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed()) watch(topic);
  }
}

void MotionMonitor::watch(const PlannedTopic& topic) {
  const MotionStop stop = stopOf(topic);
  if (isGoal(topic.output)) {
    watchAction(topic, stop);
    return;
  }
  StopMaker maker(topic.output, stop);
  if (!maker.hasMessage()) return;
  const Index output = addOutput(maker.channel(), maker.before());
  if (stop.kind == StopKind::Cancel) stops_.insert({maker.channel().topic, {{}, output}});
  commands_.emplace(topic.output.topic, Command{std::move(maker), output});
}

void MotionMonitor::watchAction(const PlannedTopic& topic, const MotionStop& stop) {
  const Channel& channel = topic.output;
  Action action{Schema::of(channel)};
  const StopMaker maker(channel, stop);
  if (maker.hasMessage()) {
    action.cancel = addOutput(maker.channel(), maker.before());
    stops_.insert({maker.channel().topic, {channel.topic, *action.cancel}});
  }
  const auto halt = haltChannel(channel);
  if (halt && maker.hasMessage()) {
    action.halt = addOutput(*halt, haltMessage());
    stops_.insert({halt->topic, {channel.topic, *action.halt}});
  }
  if (isGripperGoal(channel) && stop.rule.empty()) action.hold = addOutput(channel, {});
  actions_.emplace(channel.topic, std::move(action));
}

MotionMonitor::Index MotionMonitor::addOutput(const Channel& channel, Bytes stop) {
  outputs_.push_back({channel, std::move(stop)});
  return static_cast<Index>(outputs_.size() - 1);
}

MotionMonitor::Change MotionMonitor::sending(const Channel& channel, const Bytes& bytes) {
  Change change;
  stopped(channel.topic, bytes, change);
  const auto to = commands_.find(channel.topic);
  if (to != commands_.end()) command(to->second, bytes, change);
  const auto action = actions_.find(channel.topic);
  if (action != actions_.end()) openGoal(channel.topic, action->second, bytes, change);
  return change;
}

void MotionMonitor::command(const Command& to, const Bytes& bytes, Change& change) {
  Bytes stop = to.stop.after(bytes);
  change.is_motion = !to.stop.isNeutral(bytes);
  change.has_changed = setMoving(to.output, change.is_motion) || change.has_changed;
  change.has_other_stop = stop != outputs_[to.output].stop;
  outputs_[to.output].stop = std::move(stop);
}

void MotionMonitor::openGoal(const std::string& topic, Action& action, const Bytes& bytes,
                             Change& change) {
  const std::string id = stringAt(action.goal, bytes, "goal_id.id");
  change.is_motion = true;
  action.is_aborted = false;
  action.open.insert(id);
  if (action.hold) {
    action.last = bytes;
    action.gap.reset();
    outputs_[*action.hold].stop.clear();
  }
  goals_.open(topic, id);
  change.has_changed = lookAtGoals() || change.has_changed;
}

/// A cancel, or a trajectory that halts a controller.
void MotionMonitor::stopped(const std::string& topic, const Bytes& bytes, Change& change) {
  const auto [begin, end] = stops_.equal_range(topic);
  for (auto stop = begin; stop != end; ++stop) {
    const auto& [goals, output] = stop->second;
    const auto action = actions_.find(goals);
    if (action == actions_.end()) {
      change.has_changed = setMoving(output, false) || change.has_changed;
    } else if (action->second.halt == output) {
      action->second.is_aborted = false;
    } else {
      if (action->second.gap && goals_.isOpen(goals)) {
        change.instead = outputs_[*action->second.hold];
      }
      goals_.cancel(goals, canceledId(bytes));
    }
  }
  if (begin != end) change.has_changed = lookAtGoals() || change.has_changed;
}

bool MotionMonitor::gapMeasured(double gap) {
  constexpr double kOtherGap = 0.0005;  // m
  bool has_changed = false;
  for (auto& [topic, action] : actions_) {
    const bool is_known = action.gap && std::abs(*action.gap - gap) < kOtherGap;
    if (!action.hold || is_known || !goals_.isOpen(topic) || !std::isfinite(gap)) continue;
    Output& hold = outputs_[*action.hold];
    hold.stop = gapGoal(hold.channel, action.last, gap);
    action.gap = gap;
    has_changed = true;
  }
  if (has_changed) lookAtGoals();
  return has_changed;
}

MotionMonitor::End MotionMonitor::goalEnded(const std::string& id) {
  goals_.close(id);
  End end;
  for (auto& [topic, action] : actions_) {
    const bool is_of_it = action.open.erase(id) > 0;
    const bool is_last = is_of_it && !goals_.isOpen(topic);
    if (is_last && action.halt && goals_.endOf(id).first == GoalOutcome::Failed) {
      action.is_aborted = true;
      end.halt = outputs_[*action.halt];
    }
  }
  end.has_changed = lookAtGoals();
  return end;
}

/// True if an action's goals have set it in motion, or have all ended.
bool MotionMonitor::lookAtGoals() {
  bool has_changed = false;
  for (const auto& [topic, action] : actions_) {
    const bool is_open = goals_.isOpen(topic);
    if (action.hold) has_changed |= setMoving(*action.hold, is_open && action.gap);
    if (action.cancel) has_changed |= setMoving(*action.cancel, is_open && !action.gap);
    if (action.halt) has_changed |= setMoving(*action.halt, is_open || action.is_aborted);
  }
  return has_changed;
}

bool MotionMonitor::setMoving(Index output, bool is_moving) {
  return is_moving ? moving_.insert(output).second : moving_.erase(output) > 0;
}

}  // namespace afterglow::replay
