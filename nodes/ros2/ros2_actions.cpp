#include "nodes/ros2/ros2_actions.hpp"

#include <control_msgs/FollowJointTrajectoryAction.h>
#include <control_msgs/GripperCommandAction.h>
#include <control_msgs/PointHeadAction.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "replay/messages/definitions.hpp"
#include "replay/messages/text.hpp"
#include "replay/ros2/ros2_definition.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kSendGoal = "/_action/send_goal";
constexpr const char* kRequest = "_SendGoal_Request";
/// ROS 1's subscribers get the last results by then.
constexpr auto kFarewell = std::chrono::seconds(2);

std::string withoutEnd(const std::string& text, std::string_view end) {
  return text.substr(0, text.size() - end.size());
}

using Definitions = std::map<std::string, replay::Definition>;

template <typename... Messages>
void addDefinitions(Definitions& known) {
  namespace traits = ros::message_traits;
  (known.insert({traits::DataType<Messages>::value(),
                 {traits::Definition<Messages>::value(), traits::MD5Sum<Messages>::value()}}),
   ...);
}

template <typename Action>
void addAction(Definitions& known) {
  using Goal = typename Action::_action_goal_type;
  using Result = typename Action::_action_result_type;
  using Feedback = typename Action::_action_feedback_type;
  addDefinitions<Goal, Result, Feedback, typename Goal::_goal_type, typename Result::_result_type,
                 typename Feedback::_feedback_type>(known);
}

/// ROS 1's definitions: those on this machine, and those of control_msgs, which it may lack.
std::optional<replay::Definition> ros1Definition(const std::string& type) {
  static const Definitions kBuiltIn = [] {
    Definitions known;
    addAction<control_msgs::FollowJointTrajectoryAction>(known);
    addAction<control_msgs::GripperCommandAction>(known);
    addAction<control_msgs::PointHeadAction>(known);
    return known;
  }();
  if (auto installed = replay::findInstalled()(type)) return installed;
  const auto known = kBuiltIn.find(type);
  return known == kBuiltIn.end() ? std::nullopt : std::optional(known->second);
}

const DdsEndpoint* endpointOf(const std::vector<DdsEndpoint>& all, const DdsEndpoint& server,
                              const std::string& topic) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const DdsEndpoint& endpoint) {
    return endpoint.topic == topic && endpoint.guid.isOfParticipant(server.guid);
  });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

Ros2Actions::Ros2Actions(DdsParticipant& participant, Ros2Types& types, BridgeRefusals& refusals)
    : participant_(participant), types_(types), refusals_(refusals) {}

bool Ros2Actions::look(const std::vector<DdsEndpoint>& all) {
  servers_.clear();
  for (const DdsEndpoint& endpoint : all) {
    const auto service = replay::serviceOfDds(endpoint.topic);
    if (endpoint.is_writer || !service || !replay::endsWith(*service, kSendGoal)) continue;
    servers_[withoutEnd(*service, kSendGoal)].push_back(endpoint);
  }
  endUnlessThere();
  bool is_settled = true;
  for (const auto& [action, endpoints] : servers_) {
    try {
      if (!serve(action, endpoints.front(), all)) is_settled = false;
    } catch (const std::runtime_error& error) {  // of messages, of DDS, of ROS
      refusals_.tell(action, error.what());
    }
  }
  return is_settled;
}

void Ros2Actions::endUnlessThere() {
  const Time now = std::chrono::steady_clock::now();
  for (auto served = served_.begin(); served != served_.end();) {
    auto& [action, end] = served->second;
    const auto there = servers_.find(served->first);
    const bool is_there =
        there != servers_.end() &&
        std::any_of(there->second.begin(), there->second.end(),
                    [&](const auto& server) { return server.guid == action->server(); });
    if (!is_there && !end) {
      action->onServerGone();
      end = now + kFarewell;
    }
    served = end && now >= *end ? served_.erase(served) : std::next(served);
  }
}

bool Ros2Actions::serve(const std::string& action, const DdsEndpoint& server,
                        const std::vector<DdsEndpoint>& all) {
  const auto served = served_.find(action);
  if (served != served_.end()) return served->second.end || served->second.action->begin();
  const auto request = replay::typeOfDds(server.type);
  if (!request || !replay::endsWith(*request, kRequest)) {
    throw replay::MessageError("its goals' type is " + server.type + ", no action's");
  }
  const std::string type = withoutEnd(*request, kRequest);
  const std::string name = replay::ros1TypeName(type);
  auto definition = replay::ros2Action(name, replay::installedRos2Definitions(), ros1Definition);
  if (!definition) {
    throw replay::MessageError("no " + name + ".action is in the folders of AMENT_PREFIX_PATH");
  }
  const DdsEndpoint* const feedback = endpointOf(all, server, "rt" + action + "/_action/feedback");
  if (!feedback) return false;
  const auto told = types_.find(type + "_FeedbackMessage", *feedback, all);
  if (!told) return false;
  if (!told->empty()) definition->feedback = replay::actionFeedbackIn(*told, type);
  const replay::ActionType converted(name, *definition, ros1Definition);
  if (!converted.whyOwn().empty()) {
    ROS_INFO_STREAM(action << " has the fields of ROS 2: " << converted.whyOwn());
  }
  served_[action].action = std::make_unique<ActionToRos1>(
      participant_, converted,
      ActionToRos1::Options{action, type, server.guid, feedback->qos.is_reliable});
  refusals_.forget(action);
  return served_[action].action->begin();
}

}  // namespace afterglow::nodes
