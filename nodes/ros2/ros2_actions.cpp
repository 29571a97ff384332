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
constexpr const char* kResult = "/result";
/// A server of ROS 1 tells its status some times a second.
constexpr auto kFirstStatus = std::chrono::seconds(5);
/// Clients get the last results by then.
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

/// Whether ROS 1 has a server of the action, by the master; not this bridge's.
bool hasServer(const RosGraph& ros1, const std::string& action) {
  return !ros1.otherPublishers(action + "/status").empty() &&
         !ros1.otherPublishers(action + kResult).empty() &&
         !ros1.otherSubscribers(action + "/goal").empty();
}

}  // namespace

Ros2Actions::Ros2Actions(DdsParticipant& participant, Ros2Types& types, BridgeRefusals& refusals)
    : participant_(participant), types_(types), refusals_(refusals) {}

/// An action's type, as a server or a client of ROS 2 has it.
struct Ros2Actions::Found {
  std::string ros2_type;  ///< "test_msgs/action/Fibonacci"
  replay::ActionType type;
  DdsQos feedback;
};

bool Ros2Actions::look(const std::vector<DdsEndpoint>& all, const Ros1& ros1) {
  sort(all, ros1);
  endUnless(to_ros1_, [this](const std::string& name, const ActionToRos1& action) {
    const auto there = servers_.find(name);
    return there != servers_.end() &&
           std::any_of(there->second.begin(), there->second.end(),
                       [&](const auto& server) { return server.guid == action.server(); });
  });
  endUnless(to_ros2_, [&](const std::string& name, const ActionToRos2& action) {
    const bool is_wanted =
        wanted_.count(name) > 0 || (action.isBusy() && hasServer(ros1.graph, name));
    return is_wanted && servers_.count(name) == 0 && !action.isServerGone();
  });
  bool is_settled = true;
  const auto serve = [&](const Endpoints& actions, const auto& serveOne) {
    for (const auto& [action, endpoints] : actions) {
      try {
        if (!serveOne(action, endpoints.front())) is_settled = false;
      } catch (const std::runtime_error& error) {  // of messages, of DDS, of ROS
        refusals_.tell(action, error.what());
      }
    }
  };
  serve(servers_,
        [&](const auto& action, const auto& server) { return serveOnRos1(action, server, all); });
  serve(wanted_, [&](const auto& action, const auto& client) {
    return serveOnRos2(action, client, all, ros1);
  });
  return is_settled;
}

void Ros2Actions::sort(const std::vector<DdsEndpoint>& all, const Ros1& ros1) {
  servers_.clear();
  wanted_.clear();
  for (const DdsEndpoint& endpoint : all) {
    const auto service = replay::serviceOfDds(endpoint.topic);
    if (!service || !replay::endsWith(*service, kSendGoal)) continue;
    const std::string action = withoutEnd(*service, kSendGoal);
    if (!endpoint.is_writer) {
      servers_[action].push_back(endpoint);
    } else if (hasServer(ros1.graph, action)) {
      wanted_[action].push_back(endpoint);
    }
  }
  for (const auto& [action, endpoints] : servers_) wanted_.erase(action);
}

template <typename Action, typename IsThere>
void Ros2Actions::endUnless(std::map<std::string, Served<Action>>& served,
                            const IsThere& is_there) {
  const Time now = std::chrono::steady_clock::now();
  for (auto one = served.begin(); one != served.end();) {
    auto& [action, begin, end] = one->second;
    if (!end && !is_there(one->first, *action)) {
      action->onServerGone();
      end = now + kFarewell;
    }
    one = end && now >= *end ? served.erase(one) : std::next(one);
  }
}

std::optional<Ros2Actions::Found> Ros2Actions::find(const std::string& action,
                                                    const DdsEndpoint& goals,
                                                    const std::vector<DdsEndpoint>& all) {
  const auto request = replay::typeOfDds(goals.type);
  if (!request || !replay::endsWith(*request, kRequest)) {
    throw replay::MessageError("its goals' type is " + goals.type + ", no action's");
  }
  const std::string type = withoutEnd(*request, kRequest);
  const std::string name = replay::ros1TypeName(type);
  auto definition = replay::ros2Action(name, replay::installedRos2Definitions(), ros1Definition);
  if (!definition) {
    throw replay::MessageError("no " + name + ".action is in the folders of AMENT_PREFIX_PATH");
  }
  const DdsEndpoint* const feedback = endpointOf(all, goals, "rt" + action + "/_action/feedback");
  if (!feedback) return std::nullopt;
  const auto told = types_.find(type + "_FeedbackMessage", *feedback, all);
  if (!told) return std::nullopt;
  if (!told->empty()) definition->feedback = replay::actionFeedbackIn(*told, type);
  return Found{type, {name, *definition, ros1Definition}, feedback->qos};
}

bool Ros2Actions::serveOnRos1(const std::string& action, const DdsEndpoint& server,
                              const std::vector<DdsEndpoint>& all) {
  const auto served = to_ros1_.find(action);
  if (served != to_ros1_.end()) return served->second.end || served->second.action->begin();
  const auto found = find(action, server, all);
  if (!found) return false;
  if (!found->type.whyOwn().empty()) {
    ROS_INFO_STREAM(action << " has the fields of ROS 2: " << found->type.whyOwn());
  }
  to_ros1_[action].action = std::make_unique<ActionToRos1>(
      participant_, found->type,
      ActionToRos1::Options{action, found->ros2_type, server.guid, found->feedback.is_reliable});
  refusals_.forget(action);
  return to_ros1_[action].action->begin();
}

bool Ros2Actions::serveOnRos2(const std::string& action, const DdsEndpoint& client,
                              const std::vector<DdsEndpoint>& all, const Ros1& ros1) {
  const Time now = std::chrono::steady_clock::now();
  const auto served = to_ros2_.find(action);
  if (served != to_ros2_.end()) {
    if (served->second.end) return true;
    if (served->second.action->begin()) {
      refusals_.forget(action);
      return true;
    }
    if (now < served->second.begin + kFirstStatus) return false;
    throw std::runtime_error(
        "its server in ROS 1 is silent, or has other fields than ROS 2's definition");
  }
  const auto found = find(action, client, all);
  if (!found) return false;
  const auto told = ros1.types.find(action + kResult);
  if (told != ros1.types.end() && told->second != found->type.result().type) {
    throw std::runtime_error("its server in ROS 1 tells " + told->second +
                             ", a client in ROS 2 wants " + found->type.result().type);
  }
  Served<ActionToRos2>& begun = to_ros2_[action];
  begun.action =
      std::make_unique<ActionToRos2>(participant_, found->type, action, found->ros2_type);
  begun.begin = now;
  return false;
}

}  // namespace afterglow::nodes
