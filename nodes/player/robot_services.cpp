#include "nodes/player/robot_services.hpp"

#include <controller_manager_msgs/ListControllers.h>
#include <ros/service.h>

#include "replay/messages/ranges.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kManagerPatience = 1.0;  // s, for its node to answer
constexpr const char* kManager = "controller_manager";

/// "/robot1/" for "/robot1/controller_manager/list_controllers"; empty for another service.
std::string namespaceOf(const std::string& service) {
  const std::string end = std::string("/") + kManager + "/list_controllers";
  return replay::endsWith(service, end) ? service.substr(0, service.size() - end.size() + 1) : "";
}

}  // namespace

ControllerStates askControllers(const RosGraph& graph) {
  ControllerStates states;
  for (const auto& [service, nodes] : graph.services) {
    const std::string place = namespaceOf(service);
    if (place.empty()) continue;
    // A dead node may stay registered forever.
    const bool answers = replay::anyOf(
        nodes, [](const auto& node) { return isAlive(node, deadlineIn(kManagerPatience)); });
    controller_manager_msgs::ListControllers question;
    if (!answers || !ros::service::call(service, question)) continue;
    for (const auto& controller : question.response.controller) {
      states[place + controller.name] = controller.state;
    }
  }
  return states;
}

std::string whyNotRunning(const ControllerStates& states, const std::string& topic) {
  for (const auto& [name, state] : states) {
    const bool is_its = topic.compare(0, name.size() + 1, name + "/") == 0;
    if (!is_its || state == "running") continue;
    const std::size_t slash = name.rfind('/');
    const std::string place = name.substr(0, slash), controller = name.substr(slash + 1);
    return name.substr(1) + " is " + state + " (" + kManager + "): start it with `" +
           (place.empty() ? "" : "ROS_NAMESPACE=" + place + " ") +
           "rosrun controller_manager controller_manager start " + controller + "`";
  }
  return "";
}

namespace {

constexpr const char* kAnyMd5 = "*";

}  // namespace

StateValidity::StateValidity(const replay::RobotNames& robot) {
  ros::NodeHandle node;
  name_ = node.resolveName(robot.topic("/check_state_validity"));
  ros::ServiceClientOptions options(name_, kAnyMd5, true, {});
  client_ = node.serviceClient(options);
}

bool StateValidity::isThere() const { return ros::service::exists(name_, false); }

std::string StateValidity::whyNot(const std::vector<std::string>& joints,
                                  const std::vector<double>& positions) {
  StateValidityRequest request;
  request.joint_state.name = joints;
  request.joint_state.position = positions;
  StateValidityResponse response;
  if (!client_.call(request, response, kAnyMd5)) return name_ + " does not answer";
  return response.valid != 0 ? "" : "by MoveIt it would collide there";
}

}  // namespace afterglow::nodes
