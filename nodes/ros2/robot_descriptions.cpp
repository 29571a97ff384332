#include "nodes/ros2/robot_descriptions.hpp"

#include <ros/ros.h>
#include <std_msgs/String.h>

#include <iterator>
#include <utility>

#include "nodes/conversion/typed_message.hpp"
#include "replay/messages/text.hpp"
#include "replay/ros2/ros2_topic.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kDescription = "/robot_description";
constexpr const char* kText = "std_msgs/msg/String";

std::string textOf(const std::string& topic, const replay::Bytes& cdr) {
  namespace traits = ros::message_traits;
  using std_msgs::String;
  const replay::Ros2Description description{topic, kText, "cdr", "", "", ""};
  const auto find = [](const std::string&) {
    return std::optional(
        replay::Definition{traits::Definition<String>::value(), traits::MD5Sum<String>::value()});
  };
  replay::Ros2Topic conversion(description, find, replay::Ros2Topic::Source::Robot);
  const auto message = toMessage<String>(conversion.toRos1(cdr));
  if (!message) throw replay::MessageError("it is no text");
  return message->data;
}

}  // namespace

RobotDescriptions::RobotDescriptions(DdsParticipant& participant, BridgeRefusals& refusals,
                                     std::function<void()> on_told)
    : participant_(participant), refusals_(refusals), on_told_(std::move(on_told)) {}

void RobotDescriptions::look(const std::vector<DdsEndpoint>& all) {
  std::set<std::string> there;
  for (const DdsEndpoint& endpoint : all) {
    const auto topic = replay::topicOfDds(endpoint.topic);
    const bool is_description = topic && replay::endsWith(*topic, kDescription) &&
                                endpoint.is_writer && endpoint.qos.is_transient_local &&
                                endpoint.type == replay::ddsTypeName(kText);
    if (!is_description) continue;
    there.insert(*topic);
    if (readers_.count(*topic) > 0) continue;
    readers_[*topic] = std::make_unique<DdsReader>(
        participant_, endpoint.topic, endpoint.type, DdsQos{endpoint.qos.is_reliable, true, 1},
        [this, name = *topic](DdsSample&& sample) { take(name, sample); });
  }
  for (auto reader = readers_.begin(); reader != readers_.end();) {
    reader = there.count(reader->first) > 0 ? std::next(reader) : readers_.erase(reader);
  }
}

void RobotDescriptions::take(const std::string& topic, const DdsSample& sample) {
  // Another bridge's is what ROS 1 has already.
  if (!participant_.qosOf(sample.writer)) return;
  try {
    std::string text = textOf(topic, sample.cdr);
    const std::lock_guard<std::mutex> lock(mutex_);
    told_[topic] = std::move(text);
  } catch (const replay::MessageError& error) {
    return refusals_.tellBadMessage(topic, error.what());
  }
  on_told_();
}

void RobotDescriptions::set() {
  std::map<std::string, std::string> told;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    told.swap(told_);
  }
  for (const auto& [name, text] : told) {
    std::string now;
    const bool is_set = ros::param::get(name, now);
    if (is_set && now != text && own_.count(name) == 0) {
      refusals_.tell(name, "the parameter of that name on ROS 1 is another description, and stays");
      continue;
    }
    if (is_set && now == text) continue;
    ros::param::set(name, text);
    own_.insert(name);
    ROS_INFO_STREAM("the parameter " << name << " is that of ROS 2");
  }
}

}  // namespace afterglow::nodes
