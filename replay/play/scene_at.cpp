#include "replay/play/scene_at.hpp"

#include <algorithm>
#include <utility>

#include "replay/messages/schema.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int32_t kMarkerDelete = 2, kMarkerDeleteAll = 3;  // visualization_msgs/Marker
constexpr std::int64_t kSecondNs = 1'000'000'000;

template <typename T>
T& memberOf(Value& message, const std::string& field) {
  if (auto* object = std::get_if<Object>(&message)) {
    for (auto& [key, value] : *object) {
      if (key == field && std::holds_alternative<T>(value)) return std::get<T>(value);
    }
  }
  throw MessageError("a marker without " + field);
}

bool arrivedEarlier(const Message& a, const Message& b) {
  return a.received != b.received ? a.received < b.received : a.sequence < b.sequence;
}

Message withoutBytes(const Message& message) {
  return {message.channel, message.received, message.sequence, message.header_stamp, {}};
}

}  // namespace

bool isMarkers(const std::string& type) {
  return type == "visualization_msgs/Marker" || type == "visualization_msgs/MarkerArray";
}

void SceneAt::add(const Channel& channel, Modality modality, Message message) {
  const std::string& topic = channel.topic;
  if (modality == Modality::Body) {
    if (isGoal(channel)) {
      targets_[actionOf(topic)] = std::move(message);
    } else if (isTrajectoryCommand(channel)) {
      targets_[topic] = std::move(message);
    } else if (channel.type == kGoalIdType) {
      targets_.erase(actionOf(topic));
    }
  } else if (isMarkers(channel.type)) {
    addMarkers(channel, message);
  } else if (channel.latching) {
    latched_[message.channel] = std::move(message);
  } else if (isReplacing(channel.type)) {
    last_[topic] = std::move(message);
  }
}

void SceneAt::addMarkers(const Channel& channel, const Message& message) {
  try {
    MarkerTopic& topic = markers_[channel.topic];
    if (!topic.schema) {
      topic.schema = Schema::of(channel);
      topic.is_array = channel.type != "visualization_msgs/Marker";
    }
    Value document = decode(*topic.schema, message.bytes);
    if (!topic.is_array) {
      addMarker(message, std::move(document), topic.markers);
      return;
    }
    for (Value& marker : memberOf<Array>(document, "markers")) {
      addMarker(message, std::move(marker), topic.markers);
    }
  } catch (const MessageError&) {  // not sent either
  }
}

void SceneAt::addMarker(const Message& message, Value marker, Markers& markers) {
  const auto key =
      std::make_pair(memberOf<std::string>(marker, "ns"), memberOf<std::int32_t>(marker, "id"));
  const std::int32_t action = memberOf<std::int32_t>(marker, "action");
  if (action == kMarkerDeleteAll) {
    markers.clear();
  } else if (action == kMarkerDelete) {
    markers.erase(key);
  } else {
    const RosDuration lifetime = memberOf<RosDuration>(marker, "lifetime");
    markers[key] = {withoutBytes(message), std::int64_t{lifetime.sec} * kSecondNs + lifetime.nsec,
                    std::move(marker)};
  }
}

void SceneAt::addLive(const MarkerTopic& topic, Stamp at, std::vector<Message>& messages) {
  std::map<std::uint64_t, std::pair<Message, Array>> arrivals;  // by sequence
  for (const auto& [key, live] : topic.markers) {
    const std::int64_t rest = live.source.received.ns + live.lifetime_ns - at.ns;
    if (live.lifetime_ns != 0 && rest <= 0) continue;
    Value marker = live.marker;
    if (live.lifetime_ns != 0) {
      memberOf<RosDuration>(marker, "lifetime") = {static_cast<std::int32_t>(rest / kSecondNs),
                                                   static_cast<std::int32_t>(rest % kSecondNs)};
    }
    auto& [message, markers] = arrivals[live.source.sequence];
    message = live.source;
    markers.push_back(std::move(marker));
  }
  // Markers that came in one message go in one again: its stamps hold for all of them.
  for (auto& [sequence, arrival] : arrivals) {
    auto& [message, markers] = arrival;
    message.bytes = topic.is_array ? encode(*topic.schema, Object{{"markers", std::move(markers)}})
                                   : encode(*topic.schema, markers.front());
    messages.push_back(std::move(message));
  }
}

std::vector<Message> SceneAt::light(Stamp at) const {
  std::vector<Message> messages;
  for (const auto& [topic, message] : last_) messages.push_back(message);
  for (const auto& [channel, message] : latched_) messages.push_back(message);
  for (const auto& [name, topic] : markers_) addLive(topic, at, messages);
  std::stable_sort(messages.begin(), messages.end(), arrivedEarlier);
  return messages;
}

std::vector<Message> SceneAt::targets() const {
  std::vector<Message> messages;
  for (const auto& [name, message] : targets_) messages.push_back(message);
  std::sort(messages.begin(), messages.end(), arrivedEarlier);
  return messages;
}

}  // namespace afterglow::replay
