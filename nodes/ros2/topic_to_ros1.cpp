#include "nodes/ros2/topic_to_ros1.hpp"

#include <iterator>
#include <set>

#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

/// Bytes of a topic that wait for its slowest subscriber.
constexpr std::size_t kMostBytes = 256 << 20;

}  // namespace

TopicToRos1::TopicToRos1(DdsParticipant& participant, BridgeRefusals& refusals,
                         replay::Ros2Topic conversion, Options options)
    : participant_(participant),
      refusals_(refusals),
      options_(std::move(options)),
      conversion_(std::move(conversion)) {
  publisher_ = advertise(options_.is_latched);
}

ros::Publisher TopicToRos1::advertise(bool is_latched) {
  const replay::Channel& channel = conversion_.channel();
  const auto tell = [on_demand = options_.on_demand](const ros::SingleSubscriberPublisher&) {
    on_demand();
  };
  ros::AdvertiseOptions options(channel.topic, static_cast<std::uint32_t>(options_.depth),
                                channel.md5, channel.type, channel.definition, tell, tell);
  options.latch = is_latched;
  return node_.advertise(options);
}

void TopicToRos1::update(const std::vector<DdsEndpoint>& writers, std::size_t own_links) {
  const bool is_wanted = publisher_.getNumSubscribers() > own_links;
  std::set<std::pair<bool, bool>> kinds;
  std::set<DdsGuid> guids;
  for (const DdsEndpoint& writer : writers) {
    kinds.insert(writer.qos.kind());
    guids.insert(writer.guid);
  }
  for (auto reader = readers_.begin(); reader != readers_.end();) {
    const auto [is_reliable, is_transient_local] = reader->first;
    const bool stays = kinds.count(reader->first) > 0 && (is_wanted || is_transient_local);
    if (stays) {
      ++reader;
      continue;
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      count_.lost += reader->second->lost();
    }
    reader = readers_.erase(reader);
  }
  for (const auto& kind : kinds) {
    if (!is_wanted || readers_.count(kind) > 0) continue;
    readers_[kind] = std::make_unique<DdsReader>(
        participant_, replay::ddsTopicName(conversion_.channel().topic), options_.dds_type,
        DdsQos{kind.first, kind.second, options_.depth},
        [this, kind](DdsSample&& sample) { take(kind, std::move(sample)); });
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto latched = latched_.begin(); latched != latched_.end();) {
    latched = guids.count(latched->first) > 0 ? std::next(latched) : latched_.erase(latched);
  }
}

ros::Publisher& TopicToRos1::publisherOf(const DdsGuid& writer, bool is_latched) {
  if (!is_latched) return publisher_;
  ros::Publisher& publisher = latched_[writer];
  if (!publisher) publisher = advertise(true);
  return publisher;
}

void TopicToRos1::publish(ros::Publisher& publisher, replay::Bytes&& bytes) {
  const std::size_t size = bytes.size();
  const bool is_full = waiting_->bytes > kMostBytes;
  // Where roscpp itself has no room, the subscriber that is behind loses the oldest one.
  if (is_full || waiting_->messages > static_cast<std::size_t>(options_.depth)) {
    ++count_.given_up;
    ROS_WARN_STREAM_THROTTLE(
        10, conversion_.channel().topic
                << ": a subscriber is too slow: " << replay::counted(count_.given_up, "message")
                << " given up so far");
  }
  if (is_full) return;
  ++count_.handed_on;
  ++waiting_->messages;
  waiting_->bytes += size;
  const auto leave = [waiting = waiting_, size](const void*) {
    --waiting->messages;
    waiting->bytes -= size;
  };
  publisher.publish(RawMessage{std::move(bytes), {waiting_.get(), leave}});
}

CarriedCount TopicToRos1::count() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  CarriedCount count = count_;
  for (const auto& [kind, reader] : readers_) count.lost += reader->lost();
  return count;
}

void TopicToRos1::take(const std::pair<bool, bool>& kind, DdsSample&& sample) {
  // A reader that asks for little hears them all; each is heard as its own kind. Afterglow's own
  // are no writers of others.
  const auto offered = participant_.qosOf(sample.writer);
  if (!offered || offered->kind() != kind) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  ++count_.heard;
  try {
    publish(publisherOf(sample.writer, kind.second), conversion_.toRos1(sample.cdr));
  } catch (const replay::MessageError& error) {
    refusals_.tellBadMessage(conversion_.channel().topic, error.what());
  }
}

}  // namespace afterglow::nodes
