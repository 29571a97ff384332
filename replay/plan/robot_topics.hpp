/// \file
/// The classes of a certain robot's topics: the table of all robots, and what its profile says.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "replay/plan/robot_profile.hpp"
#include "replay/plan/topic_role.hpp"

namespace afterglow::replay {

/// The profile's word counts before the table's where it is stricter, in this order: endless
/// motion, control input, other, body or shown. It makes a topic the body's only if the table knows
/// how its motion is stopped, and shows nothing that moves. Of its base, the velocities of people
/// are control inputs, and what lies behind the multiplexer is other.
class RobotTopics {
 public:
  /// Of no robot: the table alone.
  RobotTopics() = default;
  /// Throws std::invalid_argument, one line, for a class that is none.
  explicit RobotTopics(const RobotProfile& robot);

  TopicRole roleOf(std::string_view topic, std::string_view type) const;
  /// The base itself, by the table or the profile: not where a replay enters.
  bool isBehindMultiplexer(std::string_view topic, std::string_view type) const;
  /// Why the profile's word for this topic is refused, one clause; empty: it counts, or is none.
  std::string refusal(std::string_view topic, std::string_view type) const;
  /// The profile's names by class, as of isCalled(), the strictest class first.
  using Words = std::vector<std::pair<TopicClass, std::vector<std::string>>>;
  const Words& words() const { return words_; }

 private:
  /// What the profile calls it; the strictest, if it says several things.
  std::optional<TopicClass> wordOf(std::string_view topic) const;

  std::string robot_, output_topic_;
  Words words_;
};

}  // namespace afterglow::replay
