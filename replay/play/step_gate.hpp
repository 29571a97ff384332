/// \file
/// The gate that keeps a replay in step: messages recorded after the end of a goal wait for it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "replay/motion/goal_book.hpp"
#include "replay/motion/milestones.hpp"
#include "replay/play/transport.hpp"

namespace afterglow::replay {

/// Limits the timeline to the recorded end of the open goals, less a margin, and to the progress of
/// a driven base. Decides, and writes waits into the ledger; sends nothing. For the thread that
/// plays. Everything given outlives it.
class StepGate {
 public:
  StepGate(const PlayContext& play, const Milestones& milestones, GoalBook& goals)
      : play_(play), milestones_(milestones), goals_(goals) {}

  /// False: nothing waits, because the options say so or the robot's time is the replay's.
  bool isGated() const { return play_.options.is_in_step && !play_.options.has_recorded_time; }

  struct Move {
    bool has_moved = false;
    /// Velocities were zero while the timeline stood: those in force at this recorded moment have
    /// to be sent again.
    std::optional<Stamp> goes_on_from;
  };
  /// Moves the limit. `reached`: the goal that the timeline waited for has ended, and the timeline
  /// leaps to its recorded end.
  Move moveLimit(const std::optional<GoalBook::Ended>& reached);

  struct Stand {
    bool begins = false;   ///< velocities have to be zero from now on
    std::string too_long;  ///< a goal did not end in time and is given up: a sentence
  };
  /// Returns the stand; called while a goal holds the timeline.
  Stand stand();

  /// A goal holds the timeline now.
  bool isHeldByGoal() const;
  /// The timeline waits for this milestone.
  bool isWaitedFor(const std::optional<Milestone>& milestone) const;
  /// Returns the time at which a message is due that goes out so much earlier. A message that
  /// waited for the body is due when the limit is lifted, unless it is due later.
  SteadyTime deadlineOf(Stamp recorded, std::int64_t early_ns) const;
  /// The time at which a limit that held the timeline was last lifted.
  SteadyTime releasedAt() const { return lifted_at_; }
  /// Returns when stand() has to be called next.
  SteadyTime nextLook() const;
  /// The limit, or the end of this goal if the goal is waited for and its end comes before.
  std::optional<Stamp> limitAfter(std::optional<Stamp> limit, const std::string& topic,
                                  Stamp recorded_at) const;

  /// Prepares a pause: velocities will be zero. True if a goal holds the timeline.
  bool pause();
  /// Prepares another rate, another place, the end.
  void interrupt();
  /// The replay begins, or goes on elsewhere.
  void enter();

 private:
  std::optional<Stamp> setLimit(std::optional<Stamp> limit,
                                const std::optional<GoalBook::Ended>& reached);
  std::int64_t marginNow() const;
  std::int64_t longestWait() const;

  const PlayContext& play_;
  const Milestones& milestones_;
  GoalBook& goals_;
  std::optional<Stamp> asked_limit_;  ///< limit of the timeline, which may have passed it
  bool is_goal_limit_ = false;        ///< true: the limit is a goal's, not the base's
  std::string awaited_;               ///< the topic that sets it
  bool is_standing_ = false;          ///< velocities are zero because it is held
  Stamp lifted_from_;                 ///< the last limit that held, and until when
  SteadyTime lifted_at_;
};

}  // namespace afterglow::replay
