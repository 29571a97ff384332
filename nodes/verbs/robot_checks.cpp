#include "nodes/verbs/robot_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "replay/plan/permission.hpp"

namespace afterglow::nodes {
namespace {

const char* name(Checkup::Level level) {
  static const char* const kNames[] = {"ok", "advice", "problem"};
  return kNames[static_cast<int>(level)];
}

}  // namespace

std::string Checkup::words() const {
  return fmt::format("{:9}{}: {}{}{}", nodes::name(level), name, found, advice.empty() ? "" : "; ",
                     advice);
}

nlohmann::ordered_json Checkup::json() const {
  nlohmann::ordered_json json;
  json["name"] = name;
  json["level"] = nodes::name(level);
  json["found"] = found;
  json["advice"] = advice;
  return json;
}

std::size_t countOf(Checkup::Level level, const std::vector<Checkup>& findings) {
  return static_cast<std::size_t>(
      std::count_if(findings.begin(), findings.end(),
                    [&](const Checkup& finding) { return finding.level == level; }));
}

namespace {

using replay::RobotProfile;

/// Names all but a few of many, as people say it.
std::string someOf(const std::vector<std::string>& names) { return replay::someOf(names, 5); }

const HeardTopic* heardOn(const RunningRobot& running, const std::string& topic) {
  const auto found = running.heard.find(topic);
  return found == running.heard.end() || found->second.count == 0 ? nullptr : &found->second;
}

/// Returns why nothing came: nobody publishes it, or who does is silent.
std::string silence(const RunningRobot& running, const std::string& topic) {
  const auto publishers = running.graph.otherPublishers(topic);
  if (publishers.empty()) return "nobody publishes " + topic;
  return fmt::format("nothing came on {} in {:g} s, from {}", topic, running.seconds,
                     *publishers.begin());
}

std::string rate(const RunningRobot& running, const HeardTopic& heard) {
  return fmt::format("{:.0f} Hz", static_cast<double>(heard.count) / running.seconds);
}

// ----------------------------------------------------------------------------------------- a check

Checkup checkControllers(const RobotProfile& robot, const RunningRobot& running) {
  std::vector<std::string> there, missing, stopped;
  for (const std::string& controller : robot.controllers) {
    const bool is_there = !running.graph.otherSubscribers(controller + "/goal").empty() ||
                          !running.graph.otherSubscribers(controller).empty();
    const std::string why_not = whyNotRunning(running.controllers, controller + "/goal");
    if (why_not.empty()) {
      (is_there ? there : missing).push_back(controller);
    } else {
      stopped.push_back(why_not);
    }
  }
  if (missing.empty() && stopped.empty()) return Checkup::ok("controllers", someOf(there));
  std::string found = fmt::format("{} of {} listen", there.size(), robot.controllers.size());
  std::string advice = "start what the robot has of these; goals to the others are refused";
  if (!missing.empty()) found += "; nobody listens to " + someOf(missing);
  for (const std::string& why : stopped) found += "; " + why.substr(0, why.find(": "));
  if (!stopped.empty()) advice = stopped.front().substr(stopped.front().find(": ") + 2);
  return there.empty() ? Checkup::problem("controllers", found, advice)
                       : Checkup::advise("controllers", found, advice);
}

Checkup checkJoints(const RobotProfile& robot, const RunningRobot& running) {
  std::set<std::string> heard;
  for (const auto& [topic, what] : running.heard) {
    heard.insert(what.joints.begin(), what.joints.end());
  }
  std::vector<std::string> missing;
  const auto look = [&](const std::string& joint) {
    if (heard.count(joint) == 0) missing.push_back(joint);
  };
  for (const auto& [joint, limits] : robot.joints) look(joint);
  for (const std::string& joint : robot.gripper_joints) look(joint);
  if (heard.empty()) {
    return Checkup::problem("joints", "no joint states came",
                            "start the robot's drivers: without them nothing moves");
  }
  if (missing.empty()) return Checkup::ok("joints", fmt::format("{} are heard", heard.size()));
  return Checkup::advise("joints",
                         fmt::format("{} are heard, not {}", heard.size(), someOf(missing)),
                         "is it this robot? --robot names another, or a file of yours");
}

Checkup checkDescription(const RobotProfile&, const RunningRobot& running) {
  if (running.has_description) return Checkup::ok("description", "robot_description is set");
  return Checkup::advise("description", "robot_description is not set",
                         "load the robot's URDF: types and limits of its joints are read there");
}

Checkup checkVelocity(const RobotProfile& robot, const RunningRobot& running) {
  const std::string& topic = robot.base.velocity_topic;
  const auto nodes = running.graph.otherSubscribers(topic);
  if (nodes.empty()) {
    return Checkup::problem("base", "nobody listens to " + topic,
                            "start the base's driver, or name its topic by --base-topic of play");
  }
  return Checkup::ok("base", *nodes.begin() + " listens to " + topic);
}

Checkup checkOdometry(const RobotProfile& robot, const RunningRobot& running) {
  const std::string& topic = robot.base.odometry_topic;
  const HeardTopic* heard = heardOn(running, topic);
  if (!heard) {
    return Checkup::advise("odometry", silence(running, topic),
                           "start the base's driver: who takes over is told by it");
  }
  return Checkup::ok("odometry", topic + " comes at " + rate(running, *heard));
}

Checkup checkFrames(const RobotProfile& robot, const RunningRobot& running) {
  const RobotProfile::Base& base = robot.base;
  std::vector<std::string> chain;
  for (const std::string& frame : {base.map_frame, base.odom_frame, base.base_frame}) {
    if (!frame.empty()) chain.push_back(frame);
  }
  const std::string path = fmt::format("{}", fmt::join(chain, " -> "));
  if (running.parents.empty()) {
    return Checkup::problem("frames", "nothing came on /tf in " +
                                          fmt::format("{:g} s", running.seconds),
                            "start robot_state_publisher and the base's driver");
  }
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    if (running.areConnected(chain[i], chain[i + 1])) continue;
    const bool is_localization = chain[i] == base.map_frame;
    return Checkup::problem(
        "frames", "no " + chain[i] + " -> " + chain[i + 1] + " in tf, of " + path,
        is_localization ? "start localization (amcl) and give it the pose; it may need motion first"
                        : "start the odometry, or name your frames: --base-frame of play");
  }
  return Checkup::ok("frames", path);
}

Checkup checkScan(const RobotProfile& robot, const RunningRobot& running) {
  const std::string& topic = robot.scan_topic;
  const HeardTopic* heard = heardOn(running, topic);
  const char* const advice = "start the laser: without it the base is not driven";
  if (!heard) return Checkup::problem("scan", silence(running, topic), advice);
  const auto type = running.types.find(topic);
  if (type != running.types.end() && type->second != "sensor_msgs/LaserScan") {
    return Checkup::problem("scan", topic + " is of type " + type->second,
                            "name a sensor_msgs/LaserScan: --scan of play");
  }
  if (!running.areConnected(heard->frame, robot.base.base_frame)) {
    return Checkup::problem("scan",
                            topic + " is in frame '" + heard->frame +
                                "', which tf does not connect to " + robot.base.base_frame,
                            "start robot_state_publisher");
  }
  return Checkup::ok("scan", topic + " comes at " + rate(running, *heard));
}

Checkup checkStop(const RobotProfile& robot, const RunningRobot& running) {
  const std::string& topic = robot.emergency_stop.topic;
  const HeardTopic* heard = heardOn(running, topic);
  if (!heard) {
    return Checkup::problem("emergency stop", silence(running, topic),
                            "start the robot's drivers, or name another: --estop-topic of play");
  }
  if (!heard->stops) {
    return Checkup::problem("emergency stop", topic + ": " + heard->problem,
                            "name its field: --estop-topic " + topic + ":FIELD of play");
  }
  if (*heard->stops) {
    return Checkup::advise("emergency stop", topic + " is heard, and is pressed",
                           "release it before a replay may move the robot");
  }
  return Checkup::ok("emergency stop", topic + " is heard, and is not pressed");
}

Checkup checkGuard(const RobotProfile&, const RunningRobot& running) {
  if (running.living.count(running.names.topic(kGuardNode)) > 0) {
    return Checkup::ok("guard", "afterglow_guard runs and answers");
  }
  return Checkup::advise("guard", "afterglow_guard does not run",
                         "on the robot: roslaunch afterglow guard.launch; it stops the robot when "
                         "the network is cut");
}

Checkup checkSpeech(const RobotProfile&, const RunningRobot& running) {
  const std::string topic = running.names.topic("/robotsound");
  const std::string ours = running.names.topic("/speaker_node");
  const auto nodes = running.graph.otherSubscribers(topic);
  const bool has_ours = nodes.count(ours) > 0;
  if (nodes.empty()) {
    return Checkup::advise("speech", "nobody listens to " + topic,
                           "roslaunch afterglow speaker.launch, or sound_play");
  }
  if (has_ours && nodes.size() > 1) {
    const std::string other =
        *std::find_if(nodes.begin(), nodes.end(),
                      [&](const std::string& node) { return node != ours; });
    return Checkup::advise("speech", "speaker_node runs beside " + other + ", and is silent",
                           "stop one of them");
  }
  return Checkup::ok("speech", *nodes.begin() + " speaks");
}

/// The values of a bridge's status that are named as a topic say why it is not carried.
Checkup checkBridge(const diagnostic_msgs::DiagnosticStatus& bridge) {
  std::vector<std::string> refused;
  for (const auto& value : bridge.values) {
    const bool is_topic = !value.key.empty() && value.key[0] == '/';
    if (is_topic) refused.push_back(value.key + ": " + value.value);
  }
  const char* const name = "bridge to ROS 2";
  const std::string found = bridge.name + " " + bridge.message;
  if (refused.empty() && bridge.level == diagnostic_msgs::DiagnosticStatus::OK) {
    return Checkup::ok(name, found);
  }
  if (refused.empty()) {
    return Checkup::advise(name, found,
                           "start the robot; ROS_DOMAIN_ID is the robot's, another machine's wants "
                           "network:=subnet, and nodes need UDP beside shared memory");
  }
  return Checkup::advise(name, found + ": " + someOf(refused),
                         "nodes/ros2/README.md says what is refused");
}

// --------------------------------------------------------------------------------------- all of it

struct Check {
  const char* name;
  bool is_named;  ///< the profile says what to look for
  std::function<Checkup(const RobotProfile&, const RunningRobot&)> check;
};

std::vector<Check> checksOf(const RobotProfile& robot) {
  const bool has_joints = !robot.joints.empty() || !robot.gripper_joints.empty();
  return {{"controllers", !robot.controllers.empty(), checkControllers},
          {"joints", has_joints, checkJoints},
          {"description", true, checkDescription},
          {"base", !robot.base.velocity_topic.empty(), checkVelocity},
          {"odometry", !robot.base.odometry_topic.empty(), checkOdometry},
          {"frames", !robot.base.base_frame.empty(), checkFrames},
          {"scan", !robot.scan_topic.empty(), checkScan},
          {"emergency stop", !robot.emergency_stop.topic.empty(), checkStop},
          {"guard", true, checkGuard},
          {"speech", true, checkSpeech}};
}

}  // namespace

std::vector<Checkup> checkRobot(const RobotProfile& robot,
                                const std::optional<RunningRobot>& running) {
  std::vector<Checkup> findings;
  for (const Check& check : checksOf(robot)) {
    if (!check.is_named) continue;
    findings.push_back(running ? check.check(robot, *running)
                               : Checkup::advise(check.name, "no master", "start the robot"));
  }
  if (running) {
    for (const auto& [name, bridge] : running->bridges) findings.push_back(checkBridge(bridge));
  }
  return findings;
}

}  // namespace afterglow::nodes
