#include "nodes/ros2/action_to_ros1.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "nodes/tools/ros_graph.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {
namespace {

using replay::ActionRelay;
using replay::ActionService;
using replay::ActionTopic;

constexpr int kDepth = 100;
/// A server that runs answers a cancel within that.
constexpr double kLastCancel_s = 0.5;

/// A client's name in its requests is its writer, or its reader of replies. `own`: the writer of
/// this process's only client of the service.
replay::RequestId requestId(const DdsGuid& client, std::int64_t number, const DdsGuid& own) {
  return {client.isOfParticipant(own) ? own.bytes : client.bytes, number};
}

}  // namespace

ActionToRos1::ActionToRos1(DdsParticipant& participant, const replay::ActionType& type,
                           Options options)
    : options_(std::move(options)), type_(type), relay_(type, outlets()), ros1_(options_.action) {
  const std::string action = options_.action + "/_action/", ros2_type = options_.ros2_type;
  addService(participant, ActionService::SendGoal,
             replay::serviceNames(action + "send_goal", ros2_type + "_SendGoal"));
  addService(participant, ActionService::GetResult,
             replay::serviceNames(action + "get_result", ros2_type + "_GetResult"));
  addService(participant, ActionService::CancelGoal,
             replay::serviceNames(action + "cancel_goal", "action_msgs/srv/CancelGoal"));
  is_complete_ = true;
  addTopic(participant, action + "feedback", ros2_type + "_FeedbackMessage",
           {options_.is_feedback_reliable, false, kDepth}, &ActionRelay::onFeedback);
  addTopic(participant, action + "status", "action_msgs/msg/GoalStatusArray", {true, true, kDepth},
           &ActionRelay::onStatus);
}

ActionToRos1::~ActionToRos1() {
  ros1_.deafen();
  const auto is_told = std::make_shared<std::atomic<bool>>(false);
  ros1_.post([this, is_told](replay::Stamp now) {
    relay_.onBridgeEnds(now);
    *is_told = true;
  });
  waitUntil(deadlineIn(kLastCancel_s), [&] { return *is_told && cancels_ <= 0; });
}

ActionRelay::Outlets ActionToRos1::outlets() {
  ActionRelay::Outlets outlets;
  outlets.request = [this](ActionService service, const replay::Bytes& cdr) {
    return request(service, cdr);
  };
  outlets.publish = [this](ActionTopic topic, const replay::Bytes& bytes) {
    ros1_.publish(topic, bytes);
  };
  outlets.tell = [this](const std::string& problem) {
    ROS_WARN_STREAM_THROTTLE(1, options_.action << ": " << problem);
  };
  outlets.fresh_uuid = [] { return *replay::goalUuidOf(replay::newKey()); };
  return outlets;
}

// ----------------------------------------------------------------------------------- to ROS 2

void ActionToRos1::addService(DdsParticipant& participant, ActionService service,
                              const replay::ServiceNames& names) {
  const DdsQos qos{true, false, kDepth};
  auto requests =
      std::make_unique<DdsWriter>(participant, names.request_topic, names.request_type, qos);
  const DdsGuid own = requests->guid();
  readers_.push_back(std::make_unique<DdsReader>(
      participant, names.reply_topic, names.reply_type, qos,
      [this, service, own](DdsSample&& reply) {
        if (!is_complete_) return;
        if (service == ActionService::CancelGoal && reply.related.writer.isOfParticipant(own)) {
          --cancels_;
        }
        const auto id = requestId(reply.related.writer, reply.related.sequence, own);
        ros1_.post([this, service, id, cdr = std::move(reply.cdr)](replay::Stamp now) {
          relay_.onReply(service, id, cdr, now);
        });
      }));
  services_[service] = {std::move(requests), readers_.back().get(), nullptr};
  // A client of rmw_fastrtps waits until a service has as many readers of requests as writers of
  // replies, so that a reader of others' requests needs a writer, which says nothing. It waits for
  // all services of an action: by the one without these it knows the server.
  if (service == ActionService::GetResult) return;
  services_[service].silent =
      std::make_unique<DdsWriter>(participant, names.reply_topic, names.reply_type, qos);
  readers_.push_back(std::make_unique<DdsReader>(
      participant, names.request_topic, names.request_type, qos,
      [this, service, own](DdsSample&& request) {
        if (!is_complete_) return;
        const DdsGuid& reader = request.related.writer;
        const auto id = requestId(reader.isKnown() ? reader : request.identity.writer,
                                  request.identity.sequence, own);
        ros1_.post([this, service, id, cdr = std::move(request.cdr)](replay::Stamp now) {
          relay_.onRequest(service, id, cdr, now);
        });
      }));
}

void ActionToRos1::addTopic(DdsParticipant& participant, const std::string& name,
                            const std::string& type, const DdsQos& qos,
                            void (ActionRelay::*hear)(const replay::Bytes& cdr,
                                                      replay::Stamp now)) {
  readers_.push_back(std::make_unique<DdsReader>(
      participant, replay::ddsTopicName(name), replay::ddsTypeName(type), qos,
      [this, hear](DdsSample&& sample) {
        // Whatever floods the topics leaves room for goals and cancels.
        ros1_.post([this, hear,
                    cdr = std::move(sample.cdr)](replay::Stamp now) { (relay_.*hear)(cdr, now); },
                   kDepth);
      }));
  topics_.push_back(readers_.back().get());
}

replay::RequestId ActionToRos1::request(ActionService service, const replay::Bytes& cdr) {
  const Service& ours = services_.at(service);
  if (service == ActionService::CancelGoal) ++cancels_;
  const std::int64_t number = ours.requests->write(cdr, {ours.replies->guid(), 0}).sequence;
  return {ours.requests->guid().bytes, number};
}

bool ActionToRos1::isServers(const std::vector<DdsGuid>& matched) const {
  return std::any_of(matched.begin(), matched.end(),
                     [this](const DdsGuid& guid) { return guid.isOfParticipant(options_.server); });
}

bool ActionToRos1::isServed() const {
  return std::all_of(services_.begin(), services_.end(),
                     [this](const auto& named) {
                       return isServers(named.second.requests->matched()) &&
                              isServers(named.second.replies->matched());
                     }) &&
         std::all_of(topics_.begin(), topics_.end(),
                     [this](const DdsReader* topic) { return isServers(topic->matched()); });
}

// ----------------------------------------------------------------------------------- to ROS 1

bool ActionToRos1::begin() {
  if (ros1_.isSubscribed()) return true;
  if (!isServed()) return false;
  ros1_.post([this](replay::Stamp now) {
    ros1_.advertise(ActionTopic::Goal, type_.goal());
    ros1_.advertise(ActionTopic::Cancel, ActionOnRos1::cancel());
    ros1_.advertise(ActionTopic::Feedback, type_.feedback());
    ros1_.advertise(ActionTopic::Result, type_.result());
    ros1_.advertise(ActionTopic::Status, ActionOnRos1::status());
    relay_.tick(now);
  });
  ros1_.subscribe(ActionTopic::Goal, type_.goal(),
                  [this](const auto& bytes, auto now) { relay_.onRos1Goal(bytes, now); });
  ros1_.subscribe(ActionTopic::Cancel, ActionOnRos1::cancel(),
                  [this](const auto& bytes, auto) { relay_.onRos1Cancel(bytes); });
  ros1_.postTicks([this](replay::Stamp now) { relay_.tick(now); });
  return true;
}

void ActionToRos1::onServerGone() {
  ros1_.post([this](replay::Stamp now) { relay_.onServerGone(now); });
}

}  // namespace afterglow::nodes
