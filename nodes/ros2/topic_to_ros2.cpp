#include "nodes/ros2/topic_to_ros2.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "replay/messages/text.hpp"
#include "replay/ros2/ros2_definition.hpp"
#include "replay/ros2/twist_stamp.hpp"

namespace afterglow::nodes {
namespace {

/// Readers are met within milliseconds; one that never is, as its quality does not fit, holds up
/// nobody.
constexpr auto kMeeting = std::chrono::seconds(1);
/// Messages of a topic that are kept for those who come later.
constexpr std::int32_t kKept = 100;
/// Velocities that wait for a robot that does not hear for a while: it must not drive what was
/// meant seconds ago when it hears again.
constexpr std::int32_t kMostVelocities = 10;

std::string valueOf(const ros::M_string& header, const std::string& key) {
  const auto found = header.find(key);
  return found == header.end() ? std::string() : found->second;
}

}  // namespace

TopicToRos2::TopicToRos2(DdsParticipant& participant, BridgeRefusals& refusals, Options options)
    : participant_(participant), refusals_(refusals), options_(std::move(options)) {
  writerOf({});
}

void TopicToRos2::subscribe() {
  ros::SubscribeOptions subscription;
  subscription.initByFullCallbackType<const Event&>(
      options_.topic, 0, [this](const Event& event) { onMessage(event); });
  immediately_.take(subscription);
  if (!options_.ros1_md5.empty()) {
    subscription.md5sum = options_.ros1_md5;
    subscription.datatype = options_.ros1_type;
  }
  subscription.transport_hints = ros::TransportHints().tcpNoDelay();
  subscriber_ = node_.subscribe(subscription);
}

bool TopicToRos2::update(const std::set<std::string>& publishers, std::size_t readers) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool is_met = writerOf({}).matched().size() >= readers;
  if (!subscriber_ && (is_met || std::chrono::steady_clock::now() > begin_ + kMeeting)) {
    subscribe();
  }
  for (auto writer = writers_.begin(); writer != writers_.end();) {
    const bool stays = writer->first.empty() || publishers.count(writer->first) > 0;
    writer = stays ? std::next(writer) : writers_.erase(writer);
  }
  return subscriber_;
}

DdsWriter& TopicToRos2::writerOf(const Source& source) {
  const bool is_common = !source.is_latching;
  auto& writer = writers_[is_common ? "" : source.caller];
  if (!writer) {
    DdsQos qos{true, true, 1};
    if (is_common) qos = {true, options_.is_transient_local, options_.depth};
    if (is_common && options_.is_transient_local) qos.depth = std::min(kKept, qos.depth);
    const bool is_velocity = !replay::otherTwist(replay::ros1TypeName(options_.ros2_type)).empty();
    if (is_velocity) qos.depth = std::min(kMostVelocities, qos.depth);
    qos.is_counted = !qos.is_transient_local && !is_velocity;
    writer = std::make_unique<DdsWriter>(participant_, replay::ddsTopicName(options_.topic),
                                         replay::ddsTypeName(options_.ros2_type), qos);
  }
  return *writer;
}

TopicToRos2::Source TopicToRos2::sourceWith(const ros::M_string& header) {
  Source source{valueOf(header, "callerid"), valueOf(header, "type"),
                valueOf(header, "latching") == "1", std::nullopt};
  if (!replay::MessageToRos2::isPossible(source.type, options_.ros2_type)) {
    refusals_.tell(options_.topic, source.caller + " publishes " + source.type +
                                       ", a node of ROS 2 wants " +
                                       replay::ros1TypeName(options_.ros2_type));
    return source;
  }
  try {
    source.conversion.emplace(
        replay::MessageToRos2::Wanted{options_.topic, options_.ros2_type, options_.definition},
        source.type,
        replay::Definition{valueOf(header, "message_definition"), valueOf(header, "md5sum")});
  } catch (const replay::MessageError& error) {
    refusals_.tell(options_.topic, error.what());
  }
  return source;
}

TopicToRos2::Source& TopicToRos2::sourceOf(const Event& event) {
  const auto& header = event.getConnectionHeaderPtr();
  if (const auto known = sources_.find(header); known != sources_.end()) return known->second;
  // What only this map still holds is a connection that is gone.
  for (auto held = sources_.begin(); held != sources_.end();) {
    held = held->first.use_count() == 1 ? sources_.erase(held) : std::next(held);
  }
  return sources_.emplace(header, sourceWith(*header)).first->second;
}

void TopicToRos2::write(DdsWriter& writer, const replay::Bytes& cdr) {
  const std::uint64_t given_up = writer.givenUp();
  writer.write(cdr);
  ++count_.handed_on;
  if (writer.givenUp() == given_up) return;
  count_.given_up += writer.givenUp() - given_up;
  ROS_WARN_STREAM_THROTTLE(10, options_.topic << ": a node of ROS 2 is too slow: "
                                              << replay::counted(count_.given_up, "message")
                                              << " given up so far");
}

CarriedCount TopicToRos2::count() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return count_;
}

void TopicToRos2::onMessage(const Event& event) {
  if (event.getPublisherName() == ros::this_node::getName()) return;  // from ROS 2
  const std::lock_guard<std::mutex> lock(mutex_);
  ++count_.heard;
  try {
    Source& source = sourceOf(event);
    if (!source.conversion) return;
    const replay::Stamp now{static_cast<std::int64_t>(ros::Time::now().toNSec())};
    write(writerOf(source), source.conversion->convert(event.getConstMessage()->bytes, now));
  } catch (const replay::MessageError& error) {
    refusals_.tellBadMessage(options_.topic, error.what());
  } catch (const std::runtime_error& error) {
    ROS_WARN_STREAM_THROTTLE(10, error.what());
  }
}

}  // namespace afterglow::nodes
