/// \file
/// The plan of a replay, topic by topic, made before anything is published.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/permission.hpp"
#include "replay/plan/rewrite.hpp"
#include "replay/plan/robot_profile.hpp"
#include "replay/plan/topic_role.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct PlannedTopic {
  Channel channel;                    ///< the first message's; its name as recorded
  std::optional<TopicName> recorded;  ///< the recorded name, clean; empty: ROS has no such topic
  /// The channel to publish on, by the name that ROS will have for it; cancels follow the remapping
  /// of their goals.
  Channel output;
  std::uint64_t count = 0;
  Modality modality = Modality::Ar;
  TopicClass topic_class = TopicClass::Other;  ///< Shown only if a recording or layer asks for it
  std::string why_class;                       ///< a clause for people
  bool is_by_name = false;  ///< TopicRow::is_by_name
  NamedBy named_by = NamedBy::Nobody;
  Verdict verdict = Verdict::Publish;  ///< verdict by permission.hpp
  bool is_nameable = false;  ///< not played, but would be played if it was named
  std::string why_not;       ///< empty: it is played, with Verdict::AskOwner if that is allowed
  bool is_for_start = false;  ///< not recorded: the base is driven to the start on it, if it is off
  std::vector<RewrittenField> rewrites;
  MotionStop rule_stop;  ///< stop that a rule names; stopOf() knows the others

  bool isPlayed() const { return why_not.empty(); }
  bool movesBody() const { return isPlayed() && modality == Modality::Body; }
  bool isNamed() const { return named_by >= NamedBy::Owner; }
  /// The name that tells what it is.
  const std::string& judged() const { return recorded ? recorded->text() : channel.topic; }
};

struct PlayPlan {
  Behavior behavior;
  Stamp begin, end;  ///< the part that is played, [begin, end)
  std::vector<PlannedTopic> topics;
  RewriteSettings rewriting;

  /// Seconds into the behavior are counted from its own begin: this is where the part ends.
  std::int64_t durationNs() const { return end.ns - behavior.begin.ns; }
  std::vector<std::string> playedTopics() const;
  /// The played topics of the body.
  std::vector<std::string> motionTopics() const;
  /// Returns why nothing may be played, until some topic is left out or motion is allowed, one
  /// line; else empty.
  std::string refusal() const;
  /// Lines that a person must know before the replay: which inputs of other nodes it publishes.
  std::vector<std::string> warnings() const;
  /// Returns a line on the topics that are not played, why, and how to ask for them; or empty.
  std::string leftOutText() const;

 private:
  std::string unallowedText() const;
};

struct PlanOptions {
  std::set<Modality> only;                    ///< empty: all
  std::vector<TopicName> topics, exclude;     ///< no `topics`: all that are played by themselves
  std::vector<TopicName> also;                ///< topics of any kind to be played as well
  /// The same from a setting for all behaviors: ignored if the behavior lacks the topic or its
  /// modality is not asked for.
  std::vector<TopicName> settled;
  std::string regex, exclude_regex;           ///< have to match a whole name; empty: none
  std::map<TopicName, TopicName> remap;       ///< recorded name to published name
  std::string prefix;                         ///< a namespace, before all that is not in `remap`
  std::function<TopicName(const TopicName&)> resolve;  ///< ROS's resolution; empty: none
  double start_s = 0;                         ///< into the behavior
  std::optional<double> duration_s, until_s;  ///< seconds from the start; into the behavior
  /// The published names of the topics that a running projector shows; empty: not known.
  std::optional<std::set<std::string>> layers;
  /// Topics that the replay listens to for its safety, with a noun for each: never published.
  std::map<TopicName, std::string> obeyed;
  bool is_motion_allowed = false;  ///< permission of the robot's owner
  /// Elsewhere all topics but motion and control inputs are played, as by rosbag play.
  ReplayPlace place = ReplayPlace::Robot;
  RewriteSettings rewriting;
  RobotProfile robot;  ///< profile whose `topics` and `base` tell classes of topics
};

/// Returns the name that a topic is published by: by `remap` or `prefix`, and then as ROS resolves
/// it. Throws std::invalid_argument, one line, for names that become none.
TopicName publishedName(const TopicName& recorded, const PlanOptions& options);

/// Plays of the behavior's own topics, of these modalities, what the table of permission.hpp lets:
/// by themselves the body's, and those to be shown (drawable or speech, and named in the
/// recording's request or a projector's layer). A pattern names nothing. Of what made another
/// topic's messages, and that topic, one is played (recorded_drivers.hpp). Throws StoreError, and
/// std::invalid_argument, one line, for what is asked of topics that the behavior has not, names
/// that meet, patterns, and a part that is empty.
PlayPlan makePlan(const Store& store, const Behavior& behavior, const PlanOptions& options);

/// Returns the stop of the motion that a topic sets in motion; by its recorded name if its
/// published one tells nothing.
MotionStop stopOf(const PlannedTopic& topic);
/// Commands a velocity that holds until the next one: geometry_msgs/Twist and TwistStamped.
bool isVelocity(const Channel& channel);
/// A goal of an action, by its type's name.
bool isGoal(const Channel& channel);
/// A cancel of an action's goals.
bool isCancel(const Channel& channel);
/// A trajectory_msgs/JointTrajectory outside of an action: followed as it comes.
bool isTrajectoryCommand(const Channel& channel);
/// A message of this type replaces the one before it: clouds, scans, paths, images, maps.
bool isReplacing(const std::string& type);

}  // namespace afterglow::replay
