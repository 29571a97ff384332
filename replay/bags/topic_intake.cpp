#include "replay/bags/topic_intake.hpp"

#include <utility>

#include "replay/bags/packing.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kMostRemarks = 50;
constexpr std::uint64_t kLargestMessage = 1u << 30;

/// A bag of ROS 2 may compress each message by itself.
Bytes unpacked(Bytes bytes) {
  const auto size = zstdSize(bytes);
  if (!size) return bytes;
  if (*size > kLargestMessage) throw BagDamage("says to be larger than a GiB");
  return unpack(Packing::Zstd, std::move(bytes), *size);
}

}  // namespace

void TopicIntake::addRos1(std::uint32_t id, Channel channel) {
  try {
    const std::string why = mendDefinition(channel, find_);
    topics_[id].channel = std::move(channel);
    topics_[id].why_mended = why;
  } catch (const MessageError& error) {
    leaveOut(id, channel.topic, channel.type, error.what());
  }
}

void TopicIntake::addRos2(std::uint32_t id, const Ros2Description& description) {
  try {
    Ros2Topic ros2(description, find_);
    Topic& topic = topics_[id];
    topic.channel = ros2.channel();
    topic.why_mended = ros2.whyMended();
    topic.ros2 = std::move(ros2);
  } catch (const MessageError& error) {
    leaveOut(id, description.topic, description.type, error.what());
  }
}

void TopicIntake::leaveOut(std::uint32_t id, const std::string& topic, const std::string& type,
                           const std::string& why) {
  Topic& added = topics_[id];
  added.channel.topic = topic;
  added.channel.type = type;
  added.why_not = why;
}

std::optional<Bytes> TopicIntake::take(std::uint32_t id, Bytes bytes) {
  Topic& topic = topics_.at(id);
  if (!topic.why_not.empty()) {
    ++topic.left_out;
    return std::nullopt;
  }
  if (!topic.ros2) return bytes;
  try {
    Bytes ros1 = topic.ros2->toRos1(unpacked(std::move(bytes)));
    ++topic.taken;
    return ros1;
  } catch (const MessageError& error) {
    if (topic.left_out++ == 0) topic.first_error = error.what();
  } catch (const BagDamage& damage) {
    if (topic.left_out++ == 0) topic.first_error = std::string("a message ") + damage.what();
  }
  return std::nullopt;
}

std::vector<std::string> TopicIntake::remarks() const {
  std::vector<std::string> remarks;
  for (const auto& [id, topic] : topics_) {
    const std::string name = topic.channel.topic + " (" + topic.channel.type + ") ";
    if (!topic.why_mended.empty()) {
      remarks.push_back(mendedText(topic.channel, topic.why_mended));
    }
    if (topic.left_out > 0) {
      const std::string& why = topic.why_not.empty() ? topic.first_error : topic.why_not;
      remarks.push_back("left out " + std::to_string(topic.left_out) + " messages of " + name +
                        "as " + why);
    }
    if (topic.taken > 0 && !topic.ros2->whyForeign().empty()) {
      remarks.push_back(name + "keeps the fields of ROS 2 and is not sent to a robot of ROS 1: " +
                        topic.ros2->whyForeign());
    }
  }
  if (remarks.size() > kMostRemarks) {
    const std::size_t more = remarks.size() - kMostRemarks;
    remarks.resize(kMostRemarks);
    remarks.push_back("and " + std::to_string(more) + " more such lines");
  }
  return remarks;
}

}  // namespace afterglow::replay
