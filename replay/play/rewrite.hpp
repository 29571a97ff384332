/// \file
/// Makes a recorded message right to publish now: its stamps, its goal id, the start of its
/// trajectory. Source of the rules: actionlib's server (a known goal id is ignored silently, a goal
/// older than the last one or than a cancel is canceled at once), the joint trajectory controllers
/// (a start in the past is dropped or jumped to), tf2 (looks up at the stamp).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

/// What is done to a field.
enum class RewriteRule {
  ShiftStamp,    ///< by the time since the recording; zero ("latest", "unknown") stays zero
  PublishStamp,  ///< becomes the time of publishing
  StartNow,      ///< becomes zero: a trajectory that starts when it arrives
  FreshGoalId,   ///< becomes an id that no server knows
  SentGoalId,    ///< the recorded id becomes the one its goal was sent with this time
  CancelStamp    ///< shifted, but not before the goals it covered then
};

/// For reports: "shifted to now", ...
std::string_view describe(RewriteRule rule);

struct RewrittenField {
  std::string path;  ///< as in FieldPath
  RewriteRule rule;
};

/// The rules for one message type, in the order of its definition: every `time` field, and in
/// action goals and cancels the id. std_msgs/Header.seq is left as it was: nothing that receives
/// looks at it.
std::vector<RewrittenField> rewriteRules(const Schema& schema);

/// When a message is published.
struct PublishMoment {
  Stamp now;                  ///< ROS time
  std::int64_t shift_ns = 0;  ///< what recorded stamps have to be moved by; 0: left as they were
};

/// A goal and the id it was given, to follow it on the server's status and result topics.
struct SentGoal {
  std::string recorded_id;
  std::string id;
};

struct Rewritten {
  /// False for the cancel of a goal that was not sent this time: the server would keep it in mind.
  bool publish = true;
  std::optional<SentGoal> goal;  ///< set if the message is an action goal
};

/// Rewrites the messages of one replay, in the order they are sent; remembers its goals, so that
/// recorded cancels find them. Not thread-safe.
class Rewriter {
 public:
  /// Each call gives an id that was never used before.
  using FreshId = std::function<std::string()>;

  explicit Rewriter(FreshId fresh_id);
  ~Rewriter();

  /// What will be done to the messages of this channel. Throws MessageError if its definition
  /// cannot be understood.
  const std::vector<RewrittenField>& rules(const Channel& channel);

  /// Changes `bytes`. Throws MessageError if they do not fit the channel's definition or a stamp
  /// leaves the range of ROS time; they are not to be published then.
  [[nodiscard]] Rewritten rewrite(const Channel& channel, const PublishMoment& moment,
                                  Bytes& bytes);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Ids "<node>-<random, per generator>-<counter>".
Rewriter::FreshId uniqueGoalIds(const std::string& node);

}  // namespace afterglow::replay
