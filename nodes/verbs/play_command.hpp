/// \file
/// The command line of `afterglow play`: the options of nodes/player/play_options.hpp, and those of
/// the command itself; the table of `--classes`.
#pragma once

#include <CLI/App.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nodes/player/play_options.hpp"
#include "replay/plan/robot_profile.hpp"

namespace afterglow::nodes {

/// Returns the table of topics' classes (assets/topics.yaml, replay/plan/permission.hpp) for
/// people: an entry a row, in the order in which they count; names and types as TopicRow has them.
/// First what the robot's profile adds.
std::string topicClassesText(const replay::RobotTopics& robot);

/// An array of {class, topics, types, but (other types), why, stop (null: none is known or needed),
/// by_name}.
nlohmann::ordered_json topicClassesJson(const replay::RobotTopics& robot);

struct PlayCommand {
  std::string store, report_file;
  std::vector<std::string> behaviors;  ///< the words of one, or several ids
  bool is_dry_run = false, is_json = false, is_quiet = false, has_no_keys = false;
  std::map<const PlayOption*, OptionTexts> given;

  /// Returns the request that was given. Throws std::runtime_error and std::invalid_argument, one
  /// line.
  ReplayRequest request() const;
};

/// `command` has to live until the command line is read.
void addPlayOptions(CLI::App& verb, PlayCommand& command);

}  // namespace afterglow::nodes
