/// \file
/// What a replay will do, topic by topic, worked out before anything is published.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/play/rewrite.hpp"
#include "replay/play/topic_role.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct PlannedTopic {
  Channel channel;  ///< as the topic's first message came
  /// The same under the name it is published by. Cancels follow their goal's.
  Channel output;
  std::uint64_t count = 0;
  Modality modality = Modality::Ar;
  std::string why_not;  ///< empty: it is played
  std::vector<RewrittenField> rewrites;

  bool isPlayed() const { return why_not.empty(); }
};

struct PlayPlan {
  Behavior behavior;
  Stamp begin, end;  ///< the part that is played, [begin, end)
  std::vector<PlannedTopic> topics;
  RewriteSettings rewriting;

  /// Seconds into the behavior are counted from its own begin: this is where the part ends.
  std::int64_t durationNs() const { return end.ns - behavior.begin.ns; }
  std::vector<std::string> playedTopics() const;
  /// Those of the body that are played.
  std::vector<std::string> motionTopics() const;
};

struct PlanOptions {
  std::set<Modality> only;                    ///< empty: all
  std::vector<std::string> topics, exclude;   ///< no `topics`: all
  std::string regex, exclude_regex;           ///< have to match a whole name; empty: none
  std::map<std::string, std::string> remap;   ///< recorded name to published name
  std::string prefix;                         ///< before every name that is not in `remap`
  double start_s = 0;                         ///< into the behavior
  std::optional<double> duration_s, until_s;  ///< from the start; into the behavior
  /// Recorded time is played, too: so are transforms, states and answers of the robot.
  bool has_recorded_time = false;
  RewriteSettings rewriting;
};

/// "body,ar,speech", any of them; empty: all. Throws std::invalid_argument naming an unknown word.
std::set<Modality> parseModalities(const std::string& text);

/// Plays the behavior's own topics of these modalities, as far as they may be replayed. Throws
/// StoreError, and std::invalid_argument, one line, for what is asked of topics that the behavior
/// has not, names that are none or meet, patterns, and a part that is empty.
PlayPlan makePlan(const Store& store, const Behavior& behavior, const PlanOptions& options);

/// Commands a velocity that holds until the next one: geometry_msgs/Twist and TwistStamped.
bool isVelocity(const Channel& channel);
/// A goal of an action, by its type's name.
bool isGoal(const Channel& channel);
/// A trajectory_msgs/JointTrajectory outside of an action: followed as it comes.
bool isTrajectoryCommand(const Channel& channel);
/// A message of this type replaces the one before it: clouds, scans, paths, pictures, maps.
bool isReplacing(const std::string& type);

}  // namespace afterglow::replay
