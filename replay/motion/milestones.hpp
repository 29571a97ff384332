/// \file
/// The moments at which, by the recording, the body had finished something: the results of its
/// goals. What is shown and said after them waits for them when it is replayed.
/// Source of the semantics: actionlib's topics of an action and its GoalStatus.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

class Store;
struct PlayPlan;

/// The end of a goal, from the client's view.
enum class GoalOutcome { Open, Succeeded, Failed, Canceled };

/// actionlib_msgs/GoalStatus.status; Open for the states that are not final.
GoalOutcome outcomeOf(std::uint8_t goal_status);

/// The end of a goal, by its action server.
struct GoalEnd {
  std::uint8_t status = 0;  ///< actionlib_msgs/GoalStatus.status
  std::string reason;       ///< codes and words of its result; empty: it gave none

  GoalEnd(std::uint8_t goal_status, std::string why = {})
      : status(goal_status), reason(std::move(why)) {}
  GoalOutcome outcome() const { return outcomeOf(status); }
  /// "was aborted (PATH_TOLERANCE_VIOLATED, -4: arm_3_joint)".
  std::string words() const;
};

/// Reads a message on an action's result topic: the goal, and its end. Throws MessageError.
std::pair<std::string, GoalEnd> readResult(const std::string& type, const std::string& definition,
                                           const Bytes& bytes);

/// The consequences of a result may have been recorded so long before the result itself: each was
/// sent by another node.
constexpr std::int64_t kMilestoneMarginNs = 50'000'000;

/// The end of a goal in the recording.
struct Milestone {
  Stamp at;  ///< time of its result, or of its trajectory's end
  GoalOutcome outcome = GoalOutcome::Succeeded;
  bool is_recorded = true;  ///< false: there is no result, `at` is when its trajectory was over
  /// False for a goal that ended because another one or a cancel was sent: that ends it again.
  bool is_awaited = true;
};

/// A value.
class Milestones {
 public:
  Milestones() = default;
  /// Reads the played goals and the results that the recording has of them: matched by goal id, or
  /// by their order where the server gave the ids. Throws StoreError.
  static Milestones read(const Store& store, const PlayPlan& plan);

  /// Returns the milestone of the goal that was recorded on this topic at this moment.
  std::optional<Milestone> of(const std::string& topic, Stamp recorded_at) const;
  /// Goals of which nobody knows when they ended: a sentence a topic.
  std::vector<std::string> notes;

 private:
  std::map<std::pair<std::string, std::int64_t>, Milestone> ends_;
};

}  // namespace afterglow::replay
