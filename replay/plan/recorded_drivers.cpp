#include "replay/plan/recorded_drivers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>

#include "replay/messages/ranges.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::replay {
namespace {

using Names = std::set<std::string>;

/// A multiplexer behind a smoother behind a planner.
constexpr int kMostBehind = 3;

bool isJoystickType(const std::string& type) { return type == "sensor_msgs/Joy"; }

/// The topics of such a type that a node hears others on.
std::vector<std::string> heardBy(const std::string& node, bool (*is_type)(const std::string&),
                                 const RecordedNodes& nodes) {
  std::vector<std::string> topics;
  for (const auto& [topic, around] : nodes) {
    const bool is_heard = is_type(around.type) && around.subscribers.count(node) != 0;
    const bool is_others = around.publishers.size() > around.publishers.count(node);
    if (is_heard && is_others) topics.push_back(topic);
  }
  return topics;
}

/// Returns true if a recorder noted the hearers, and not an import, which knows the senders alone.
bool areHearersNoted(const RecordedNodes& nodes) {
  return anyOf(nodes, [](const auto& around) { return !around.second.subscribers.empty(); });
}

bool hasWord(const std::string& node, const std::vector<std::string>& words) {
  const std::string last = node.substr(node.rfind('/') + 1);
  return anyOf(words, [&](const auto& word) { return last.find(word) != std::string::npos; });
}

/// A player hears its own topic, too, to know who else drives, and perhaps a button to be held.
bool hearsItself(const std::string& topic, const std::string& node, const RecordedNodes& nodes) {
  return nodes.at(topic).subscribers.count(node) != 0;
}

bool isPersons(const std::string& topic, const std::string& node, const RecordedNodes& nodes) {
  const bool is_player = hearsItself(topic, node, nodes);
  return hasWord(node, {"teleop", "joy", "keyboard"}) ||
         (!is_player && !heardBy(node, isJoystickType, nodes).empty());
}

/// The velocities of which a node makes those on this topic: not those that its hearers make of
/// them.
std::vector<std::string> mixedInto(const std::string& topic, const std::string& node,
                                   const RecordedNodes& nodes) {
  const Names& hearers = nodes.at(topic).subscribers;
  std::vector<std::string> mixed;
  if (hearsItself(topic, node, nodes)) return mixed;
  for (const std::string& other : heardBy(node, isBaseVelocity, nodes)) {
    const Names& senders = nodes.at(other).publishers;
    const auto isHearer = [&](const auto& sender) { return hearers.count(sender) != 0; };
    if (!anyOf(senders, isHearer)) mixed.push_back(other);
  }
  return mixed;
}

/// A smoother, of one velocity that was not recorded, is where a replay may enter.
bool isMultiplexer(const std::string& topic, const std::string& node, const RecordedNodes& nodes,
                   const std::vector<std::string>& recorded) {
  const std::vector<std::string> mixed = mixedInto(topic, node, nodes);
  return hasWord(node, {"mux"}) || mixed.size() > 1 ||
         anyOf(mixed, [&](const std::string& one) { return contains(recorded, one); });
}

/// Returns true if another process obeys: a program that sends and hears it all is no robot.
bool isObeyedByAnother(const TopicNodes& around) {
  return !std::includes(around.publishers.begin(), around.publishers.end(),
                        around.subscribers.begin(), around.subscribers.end());
}

void addDriversBehind(const std::string& topic, const RecordedNodes& nodes, int depth,
                      Names& drivers) {
  const auto noted = nodes.find(topic);
  if (noted == nodes.end() || depth == 0) return;
  for (const std::string& node : noted->second.publishers) {
    drivers.insert(node);
    for (const std::string& other : mixedInto(topic, node, nodes)) {
      addDriversBehind(other, nodes, depth - 1, drivers);
    }
  }
}

}  // namespace

bool isDriverNoted(const std::string& topic, const RecordedNodes& nodes) {
  const auto noted = nodes.find(topic);
  const bool is_known = noted != nodes.end() && !noted->second.publishers.empty();
  return is_known && areHearersNoted(nodes);
}

std::optional<RecordedDriver> driverOf(const std::string& topic, const RecordedNodes& nodes,
                                       const std::vector<std::string>& recorded) {
  if (!isDriverNoted(topic, nodes)) return std::nullopt;
  const TopicNodes& noted = nodes.at(topic);
  const Names& senders = noted.publishers;
  const std::string names = fmt::format("{}", fmt::join(senders, ", "));
  const auto isPerson = [&](const std::string& node) { return isPersons(topic, node, nodes); };
  if (allOf(senders, isPerson)) {
    return RecordedDriver{TopicClass::Control,
                          "a person's velocities: " + names + " alone sent them"};
  }
  const auto isMixer = [&](const std::string& node) {
    return isMultiplexer(topic, node, nodes, recorded);
  };
  if (isObeyedByAnother(noted) && allOf(senders, isMixer)) {
    return RecordedDriver{TopicClass::Other, "the base behind its multiplexer, " + names +
                                                 ": nobody could override it"};
  }
  return std::nullopt;
}

bool wasUnheard(const std::string& topic, const RecordedNodes& nodes) {
  const auto noted = nodes.find(topic);
  const bool is_noted = noted != nodes.end() && noted->second.subscribers.empty();
  return is_noted && areHearersNoted(nodes);
}

std::set<std::string> driversBehind(const std::string& topic, const RecordedNodes& nodes) {
  Names drivers;
  addDriversBehind(topic, nodes, kMostBehind, drivers);
  return drivers;
}

bool isTwist(const std::string& type) {
  return type == "geometry_msgs/Twist" || type == "geometry_msgs/TwistStamped";
}

bool isBaseVelocity(const std::string& type) {
  return isTwist(type) || type == "ackermann_msgs/AckermannDrive" ||
         type == "ackermann_msgs/AckermannDriveStamped";
}

bool tellsWhoDrove(const std::string& type) { return isBaseVelocity(type) || isJoystickType(type); }

namespace {

using Names = std::set<std::string>;

bool isKnownNesting(const PlannedTopic& higher, const PlannedTopic& lower) {
  const std::string& goal = higher.channel.topic;
  const auto& all = TopicTable::ofAllRobots().nesting;
  return anyOf(all, [&](const KnownNesting& known) {
    if (!endsWith(goal, "/" + known.higher)) return false;
    const std::string place = goal.substr(0, goal.size() - known.higher.size());
    return isBaseVelocity(lower.channel.type) == known.is_velocity &&
           isCalled(lower.channel.topic, place + known.lower);
  });
}

/// The nodes that serve a goal's action. A program that sends the goals, too, tells nothing.
Names serversOf(const std::string& goal, const RecordedNodes& nodes) {
  const auto around = [&](const std::string& topic) {
    const auto noted = nodes.find(topic);
    return noted == nodes.end() ? TopicNodes() : noted->second;
  };
  Names servers = around(goal).subscribers;
  for (const char* answer : {"/status", "/feedback", "/result"}) {
    const Names tellers = around(actionOf(goal) + answer).publishers;
    servers.insert(tellers.begin(), tellers.end());
  }
  for (const std::string& client : around(goal).publishers) servers.erase(client);
  return servers;
}

Names sendersOf(const PlannedTopic& topic, const RecordedNodes& nodes) {
  const std::string& name = topic.channel.topic;
  if (isBaseVelocity(topic.channel.type)) return driversBehind(name, nodes);
  const auto noted = nodes.find(name);
  return noted == nodes.end() ? Names() : noted->second.publishers;
}

bool meet(const Names& some, const Names& others) {
  return anyOf(some, [&](const std::string& name) { return others.count(name) != 0; });
}

/// Plays its own controller, not others' goals.
bool isOfController(const PlannedTopic& topic) {
  return topic.topic_class == TopicClass::Body && !topic.is_by_name;
}

/// Returns true if the one may have been sent because of the other at all.
bool isPair(const PlannedTopic& higher, const PlannedTopic& lower) {
  const bool is_motion = lower.topic_class == TopicClass::Body &&
                         lower.modality == Modality::Body && lower.channel.type != kGoalIdType;
  const bool is_arm_and_base = isOfController(higher) && isBaseVelocity(lower.channel.type);
  return &higher != &lower && isGoal(higher.channel) && is_motion && !is_arm_and_base &&
         higher.modality == Modality::Body;
}

bool hasCaused(const PlannedTopic& higher, const PlannedTopic& lower, const RecordedNodes& nodes) {
  const Names servers = serversOf(higher.channel.topic, nodes), senders = sendersOf(lower, nodes);
  const bool is_noted = !servers.empty() && !senders.empty();
  return is_noted ? meet(servers, senders) : isKnownNesting(higher, lower);
}

void leaveOut(PlannedTopic& topic, const std::string& why) {
  topic.why_not = why;
  topic.verdict = Verdict::LeaveOut;
  topic.is_nameable = true;
}

void choose(PlannedTopic& higher, PlannedTopic& lower) {
  const std::string& goal = higher.channel.topic;
  const std::string& sent = lower.channel.topic;
  const std::string why_not_higher = "the robot sent " + sent + " for it, which is played instead";
  if (!higher.isPlayed()) {
    if (higher.is_nameable) higher.why_not = why_not_higher;
    return;
  }
  if (higher.isNamed() && lower.isNamed()) {
    higher.verdict = Verdict::Refuse;
    higher.why_not = "the robot sends " + sent + " for it, which is played, too: one of the two";
    return;
  }
  const bool is_bare_command = isOfController(higher) && !isGoal(lower.channel);
  const bool keeps_higher = higher.isNamed() || (is_bare_command && !lower.isNamed());
  if (keeps_higher) {
    leaveOut(lower, "the robot sent it for " + goal + ", which is played");
  } else {
    leaveOut(higher, why_not_higher);
  }
}

}  // namespace

void leaveOutNested(std::vector<PlannedTopic>& topics, const RecordedNodes& nodes) {
  for (PlannedTopic& higher : topics) {
    for (PlannedTopic& lower : topics) {
      const bool is_pair = lower.isPlayed() && isPair(higher, lower);
      if (is_pair && hasCaused(higher, lower, nodes)) choose(higher, lower);
    }
  }
}

}  // namespace afterglow::replay
