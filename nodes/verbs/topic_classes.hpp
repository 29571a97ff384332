/// \file
/// `afterglow play --classes`: assets/topics.yaml and the table of replay/plan/permission.hpp, for
/// people and programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "replay/plan/robot_profile.hpp"

namespace afterglow::nodes {

/// An entry a row, in the order in which they count; names and types as TopicRow has them. First
/// what the robot's profile adds.
std::string topicClassesText(const replay::RobotTopics& robot);

/// An array of {class, topics, types, but (other types), why, stop (null: none is known or needed),
/// by_name}.
nlohmann::ordered_json topicClassesJson(const replay::RobotTopics& robot);

}  // namespace afterglow::nodes
