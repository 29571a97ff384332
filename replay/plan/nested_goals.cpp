#include "replay/plan/nested_goals.hpp"

#include <set>
#include <string>

#include "replay/messages/ranges.hpp"
#include "replay/plan/recorded_drivers.hpp"

namespace afterglow::replay {
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
                         lower.modality == Modality::Body &&
                         lower.channel.type != "actionlib_msgs/GoalID";
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
