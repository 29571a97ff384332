/// \file
/// Which outputs of a replay have set the robot in motion, as the messages sent show, and which
/// message stops each output.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "replay/messages/schema.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/heartbeat.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::replay {

/// A velocity topic moves from a velocity to a zero one, an action from a goal to its end or
/// cancel, a trajectory command from the first point to a command without any. Not thread-safe, but
/// for the book.
class MotionWatch {
 public:
  /// A channel and the message that stops it: a zero velocity, a cancel of all goals, a trajectory
  /// without points.
  struct Output {
    Channel channel;
    Bytes stop;
  };
  /// Throws MessageError for a definition that is none.
  explicit MotionWatch(const PlayPlan& plan);

  const std::vector<Output>& outputs() const { return outputs_; }

  struct Change {
    bool is_motion = false;       ///< this message sets something in motion
    bool has_changed = false;     ///< moving() has
    bool has_other_stop = false;  ///< so has the output's stop message
    std::uint32_t output = 0;
  };
  /// A message that is about to be sent, as it is.
  Change sending(const Channel& channel, const Bytes& bytes);
  /// A goal's final status was seen. True if moving() has changed.
  bool goalEnded(const std::string& id);
  const Outputs& moving() const { return moving_; }
  /// Every goal that is sent is opened in it, every one that is canceled closed. Any thread.
  GoalBook& goals() { return goals_; }

 private:
  enum class Kind { Twist, Goal, Cancel, Trajectory };
  struct Topic {
    Kind kind;
    std::uint32_t output;
    std::string goals;  ///< the topic of the goals that a cancel is for
  };
  struct Action {
    Schema goal;
    std::uint32_t output;
  };

  bool setMoving(std::uint32_t output, bool is_moving);
  bool lookAtGoals();
  void watch(const PlannedTopic& topic);

  std::vector<Output> outputs_;
  std::map<std::string, Topic> topics_;  ///< by the name they are published by
  std::map<std::string, Action> actions_;  ///< by their goals' topics
  GoalBook goals_;
  Outputs moving_;
};

}  // namespace afterglow::replay
