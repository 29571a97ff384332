/// \file
/// The outputs of a replay that have set the robot in motion, as the messages sent show, and the
/// messages that stop them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/messages/schema.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/stops/heartbeat.hpp"
#include "replay/motion/stops/stop_maker.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::replay {

/// A topic of set points moves from one that moves something to its stop, an action from a goal to
/// its end or cancel, a trajectory command from the first point to a command without any. A goal
/// that was aborted may go on (haltChannel()). Not thread-safe, but for the book.
class MotionMonitor {
 public:
  /// A channel and the message that stops what was set in motion by its own topic or another one: a
  /// set point, a cancel of all goals, a trajectory without points.
  struct Output {
    Channel channel;
    Bytes stop;
  };
  /// Throws MessageError for a definition that is none.
  explicit MotionMonitor(const PlayPlan& plan);

  const std::vector<Output>& outputs() const { return outputs_; }

  struct Change {
    bool is_motion = false;       ///< true: this message sets something in motion
    bool has_changed = false;     ///< moving() has
    bool has_other_stop = false;  ///< so has an output's stop message
    /// The message to be sent instead: a gripper stops by a goal at its gap, not by a cancel.
    std::optional<Output> instead;
  };
  /// A message that is about to be sent, as it is.
  Change sending(const Channel& channel, const Bytes& bytes);

  struct End {
    bool has_changed = false;    ///< moving() has
    std::optional<Output> halt;  ///< message to be sent now: the goal was aborted and may go on
  };
  /// A goal's final status was seen, and is in the book.
  End goalEnded(const std::string& id);
  /// The gripper's gap as measured now. True if an output has another stop then.
  bool gapMeasured(double gap);
  const Outputs& moving() const { return moving_; }
  /// The book of goals: each goal is opened in it when it is sent, and closed when it is canceled.
  /// Any thread.
  GoalBook& goals() { return goals_; }

 private:
  using Index = std::uint32_t;  ///< Index of an output.
  struct Command {
    StopMaker stop;
    Index output;
  };
  struct Action {
    Schema goal;
    std::optional<Index> cancel = {}, halt = {}, hold = {};
    std::set<std::string> open = {};  ///< ids whose final status was not seen
    bool is_aborted = false;          ///< true: an aborted goal perhaps moves on
    Bytes last = {};                  ///< last message of a gripper
    std::optional<double> gap = {};   ///< gap that the hold is for
  };
  /// The purpose of a stop on this topic.
  struct Stopped {
    std::string topic;  ///< topic of goals; empty: a command
    Index output;
  };

  void watch(const PlannedTopic& topic);
  void watchAction(const PlannedTopic& topic, const MotionStop& stop);
  Index addOutput(const Channel& channel, Bytes stop);
  void command(const Command& to, const Bytes& bytes, Change& change);
  void openGoal(const std::string& topic, Action& action, const Bytes& bytes, Change& change);
  void stopped(const std::string& topic, const Bytes& bytes, Change& change);
  bool setMoving(Index output, bool is_moving);
  bool lookAtGoals();

  std::vector<Output> outputs_;
  std::map<std::string, Command> commands_;    ///< commands by the name they are published by
  std::map<std::string, Action> actions_;      ///< actions by their goals' topics
  std::multimap<std::string, Stopped> stops_;  ///< stops by the topics of cancels and halts
  GoalBook goals_;
  Outputs moving_;
};

}  // namespace afterglow::replay
