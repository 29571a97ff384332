#include "nodes/ros2/action_to_ros2.hpp"

#include <chrono>
#include <thread>
#include <utility>

#include "nodes/tools/ros_graph.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {
namespace {

using replay::ActionService;
using replay::ActionTopic;

/// What rcl_action's servers keep for a slow client.
constexpr int kFeedbackDepth = 10;
constexpr double kLastTask_s = 0.5;
/// Neither ROS nor DDS says when what was published last has left.
constexpr std::chrono::milliseconds kLeaving(100);

}  // namespace

ActionToRos2::ActionToRos2(DdsParticipant& participant, const replay::ActionType& type,
                           const std::string& action, const std::string& ros2_type)
    : participant_(participant),
      action_(action),
      ros2_type_(ros2_type),
      relay_(type, outlets()),
      ros1_(action) {
  const auto addTopic = [&](ActionTopic topic, const std::string& name, const std::string& of,
                            const DdsQos& qos) {
    writers_[topic] =
        std::make_unique<DdsWriter>(participant, replay::ddsTopicName(action + "/_action/" + name),
                                    replay::ddsTypeName(of), qos);
  };
  addTopic(ActionTopic::Feedback, "feedback", ros2_type + "_FeedbackMessage",
           {true, false, kFeedbackDepth});
  addTopic(ActionTopic::Status, "status", "action_msgs/msg/GoalStatusArray", {true, true, 1});
  ros1_.advertise(ActionTopic::Goal, type.goal());
  ros1_.advertise(ActionTopic::Cancel, ActionOnRos1::cancel());
  ros1_.subscribe(ActionTopic::Status, ActionOnRos1::status(), [this](const auto& bytes, auto now) {
    relay_.onStatus(bytes, now);
    note();
  });
  ros1_.subscribe(ActionTopic::Feedback, type.feedback(),
                  [this](const auto& bytes, auto) { relay_.onFeedback(bytes); });
  ros1_.subscribe(ActionTopic::Result, type.result(), [this](const auto& bytes, auto now) {
    relay_.onResult(bytes, now);
    note();
  });
  ros1_.postTicks([this](replay::Stamp now) {
    relay_.tick(now);
    note();
  });
}

ActionToRos2::~ActionToRos2() {
  ros1_.deafen();
  const auto is_told = std::make_shared<std::atomic<bool>>(false);
  ros1_.post([this, is_told](replay::Stamp now) {
    note();
    relay_.onBridgeEnds(now);
    *is_told = true;
  });
  waitUntil(deadlineIn(kLastTask_s), [&] { return is_told->load(); });
  if (is_busy_) std::this_thread::sleep_for(kLeaving);
  for (auto& [name, service] : services_) service->deafen();
}

replay::ActionRelayToRos2::Outlets ActionToRos2::outlets() {
  replay::ActionRelayToRos2::Outlets outlets;
  outlets.reply = [this](ActionService service, const replay::RequestId& id,
                         const replay::Bytes& cdr) {
    services_.at(service)->reply({DdsGuid{id.writer}, id.number}, cdr);
  };
  outlets.publish_on_ros2 = [this](ActionTopic topic, const replay::Bytes& cdr) {
    writers_.at(topic)->write(cdr);
  };
  outlets.publish_on_ros1 = [this](ActionTopic topic, const replay::Bytes& bytes) {
    ros1_.publish(topic, bytes);
  };
  outlets.tell = [this](const std::string& problem) {
    ROS_WARN_STREAM_THROTTLE(1, action_ << ": " << problem);
  };
  outlets.fresh_uuid = [] { return *replay::goalUuidOf(replay::newKey()); };
  return outlets;
}

void ActionToRos2::note() {
  is_alive_ = relay_.isServerAlive();
  is_busy_ = relay_.isBusy();
}

bool ActionToRos2::begin() {
  if (is_complete_) return true;
  if (!is_alive_ || !ros1_.isMet()) return false;
  services_.clear();
  addService(ActionService::GetResult, "get_result", ros2_type_ + "_GetResult");
  addService(ActionService::CancelGoal, "cancel_goal", "action_msgs/srv/CancelGoal");
  addService(ActionService::SendGoal, "send_goal", ros2_type_ + "_SendGoal");
  is_complete_ = true;
  return true;
}

void ActionToRos2::addService(ActionService service, const std::string& name,
                              const std::string& type) {
  services_[service] = std::make_unique<DdsServiceServer>(
      participant_, replay::serviceNames(action_ + "/_action/" + name, type),
      [this, service](const SampleIdentity& request, replay::Bytes&& cdr) {
        if (!is_complete_) return;
        const replay::RequestId id{request.writer.bytes, request.sequence};
        ros1_.post([this, service, id, cdr = std::move(cdr)](replay::Stamp now) {
          relay_.onRequest(service, id, cdr, now);
          note();
        });
      });
}

void ActionToRos2::onServerGone() {
  ros1_.post([this](replay::Stamp now) {
    relay_.onServerGone(now);
    note();
  });
}

}  // namespace afterglow::nodes
