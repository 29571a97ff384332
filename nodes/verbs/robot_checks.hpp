/// \file
/// `afterglow doctor`: its findings, one line a check, and whether what a robot's profile names is
/// there on the running robot.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nodes/verbs/robot_ear.hpp"

namespace afterglow::nodes {

struct Checkup {
  enum class Level { Ok, Advice, Problem };
  std::string name;  ///< name of the check: "gpu"
  Level level = Level::Ok;
  std::string found;
  std::string advice;  ///< advice in one clause; empty: there is nothing to do

  static Checkup ok(std::string name, std::string found) {
    return {std::move(name), Level::Ok, std::move(found), {}};
  }
  static Checkup advise(std::string name, std::string found, std::string advice) {
    return {std::move(name), Level::Advice, std::move(found), std::move(advice)};
  }
  static Checkup problem(std::string name, std::string found, std::string advice) {
    return {std::move(name), Level::Problem, std::move(found), std::move(advice)};
  }

  /// "advice   sound: no device; connect one".
  std::string words() const;
  nlohmann::ordered_json json() const;  ///< {name, level, found, advice}
};

std::size_t countOf(Checkup::Level level, const std::vector<Checkup>& findings);

/// A check for each thing that the profile names; without a name, those alone that need no profile.
/// Each bridge to ROS 2 that was heard is a check, too.
/// `running` without value: there is no master, and each check says so. Pure.
std::vector<Checkup> checkRobot(const replay::RobotProfile& robot,
                                const std::optional<RunningRobot>& running);

/// The guard's node on the robot, in its namespace.
constexpr const char* kGuardNode = "/afterglow_guard";

}  // namespace afterglow::nodes
