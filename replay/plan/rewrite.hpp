/// \file
/// Rewrites a recorded message so that it can be published now: its stamps, its goal id, the start
/// of its trajectory, its frames; by the rules of its type.
///
/// The fields of a type that a replay rewrites, and how: by type and field path. Source of the
/// rules: actionlib's server (a known goal id is ignored silently, a goal older than the last one
/// or than a cancel is canceled at once), the joint trajectory controllers (a start in the past is
/// dropped or jumped to), tf2 (looks up at the stamp).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/motion_stop.hpp"

namespace afterglow::replay {

/// The way in which a field is rewritten.
enum class RewriteRule {
  ShiftStamp,    ///< add the time since the recording; zero ("latest", "unknown") stays zero
  PublishStamp,  ///< becomes the time of publishing
  StartNow,      ///< becomes zero: a trajectory that starts when it arrives
  FreshGoalId,   ///< becomes an id that no server knows
  SentGoalId,    ///< becomes the id with which its goal was sent this time
  CancelStamp,   ///< zeroed, as it would cancel other clients' goals
  // Only if settings ask for them:
  Zero,       ///< times, durations and numbers
  Keep,       ///< leave it as it was recorded
  FreshId,    ///< a text becomes a fresh id, the same one for the same text; empty stays empty
  RemapFrame  ///< renamed as RewriteSettings::frame() has it
};

/// Returns words for reports: "shifted to now", ...
std::string_view describe(RewriteRule rule);

struct RewrittenField {
  std::string path;  ///< a FieldPath
  RewriteRule rule;
  std::uint64_t count = 0;  ///< number of values that were rewritten so far
};

struct RewriteSettings {
  /// Rules by type and path in it; also where the type is nested. Overrides every rule but those of
  /// the goal ids of actions.
  std::map<std::string, std::map<std::string, RewriteRule>> rules;
  std::map<std::string, std::string> frames;  ///< recorded to published, without leading slashes
  std::string tf_prefix;  ///< prefix of another robot: "robot2/base_link"; may be empty
  RobotRenaming robot;    ///< renaming of the names that neither of these renames
  std::map<TopicName, MotionStop> stops;  ///< stops by recorded topic; override what is known

  bool renamesFrames() const {
    return !frames.empty() || !tf_prefix.empty() || robot.renamesFrames();
  }
  std::string frame(const std::string& recorded) const;
};

/// "shift", "now", "zero", "keep", "fresh_id", "remap_frame"; empty for other words.
std::optional<RewriteRule> parseRule(std::string_view word);

/// The rules for one message type, in the order of its definition: every `time` field, in action
/// goals and cancels the id, what the settings name, and where they rename frames every Header's
/// frame_id and every child_frame_id. std_msgs/Header.seq is not rewritten: receivers do not use
/// it. Throws std::invalid_argument for a rule whose field is missing or of an unsuitable type.
std::vector<RewrittenField> rewriteRules(const Schema& schema,
                                         const RewriteSettings& settings = {});

/// The moment at which a message is published.
struct PublishMoment {
  Stamp now;                  ///< ROS time
  std::int64_t shift_ns = 0;  ///< added to recorded stamps; 0: they stay as they were
};

struct Rewritten {
  /// False for the cancel of a goal that was not sent this time: the server would remember it. Any
  /// other cancel names one goal of this replay.
  bool publish = true;
  /// The id that an action goal was given, by which the server tells of it; empty for others.
  std::optional<std::string> goal;
  std::string canceled;  ///< the new id of the goal that it cancels; empty: it is no cancel
};

/// Rewrites the messages of one replay, in the order they are sent; remembers its goals, so that
/// recorded cancels find them. Not thread-safe.
class Rewriter {
 public:
  /// A source of ids that were never used before.
  using FreshId = std::function<std::string()>;

  explicit Rewriter(FreshId fresh_id, RewriteSettings settings = {});
  ~Rewriter();

  /// The rules for the messages of this channel, with the counts of its topic so far. Throws
  /// MessageError if its definition cannot be understood, std::invalid_argument if the settings do
  /// not fit it.
  std::vector<RewrittenField> rules(const Channel& channel);

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
