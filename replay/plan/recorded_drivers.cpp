#include "replay/plan/recorded_drivers.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "replay/messages/ranges.hpp"

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

}  // namespace afterglow::replay
