/// \file
/// The running robot, as a node hears it in a few seconds: for `afterglow doctor` and `init`.
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/player/robot_services.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/robot_profile.hpp"

namespace afterglow::nodes {

/// The messages heard on a topic.
struct HeardTopic {
  std::size_t count = 0;
  std::string frame;             ///< frame of the first header or marker; else empty
  std::set<std::string> joints;  ///< names in JointStates
  std::optional<bool> stops;     ///< last word of the emergency stop's topic
  std::string problem;           ///< the reason why a message could not be read
};

struct RunningRobot {
  replay::RobotNames names;  ///< names in this process's namespace
  RosGraph graph;
  ControllerStates controllers;                ///< states by ros_control's controller managers
  std::map<std::string, std::string> types;    ///< types of all topics
  std::map<std::string, HeardTopic> heard;     ///< topics that were listened to
  std::map<std::string, std::string> parents;  ///< parents of tf's frames
  /// What bridges to ROS 2 last said, by their names.
  std::map<std::string, diagnostic_msgs::DiagnosticStatus> bridges;
  std::set<std::string> living;                ///< nodes that answered of those that were asked
  double seconds = 0;                        ///< so long it was listened
  bool has_description = false;              ///< robot_description is set

  bool hasFrame(const std::string& frame) const;
  /// Returns true if both are in one tree of tf.
  bool areConnected(const std::string& frame, const std::string& other) const;
  /// The robot's topics of this type that have a publisher.
  std::vector<std::string> publishedTopics(const std::string& type) const;
};

/// Listens, as a ROS node whose master answers, to `topics`, to joint states and to tf, for
/// `seconds`; asks `nodes` whether they live. A type's definition is the publisher's. Throws
/// std::runtime_error, one line, if the master does not answer.
RunningRobot listenToRobot(const replay::RobotProfile& robot, std::vector<std::string> topics,
                           const std::vector<std::string>& nodes, double seconds);

/// The topics that a profile names and that should be heard.
std::vector<std::string> topicsToHear(const replay::RobotProfile& robot);

}  // namespace afterglow::nodes
