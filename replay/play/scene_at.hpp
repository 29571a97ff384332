/// \file
/// The recorded light and targets in force at a moment, so that a replay can begin there.
/// Semantics: rviz's markers ((namespace, id) per topic, lifetimes, DELETE, DELETEALL), rosbag
/// play's latched topics (the last message of each publisher).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "replay/plan/topic_role.hpp"

namespace afterglow::replay {

/// Returns true for messages whose markers add up to a scene.
bool isMarkers(const std::string& type);

/// Fed with messages in order, up to the moment. A value; not thread-safe.
class SceneAt {
 public:
  /// A message that cannot be understood changes nothing.
  void add(const Channel& channel, Modality modality, Message message);

  /// The light that is on: markers whose lifetime is not over, with the rest of it; the last cloud,
  /// scan, path, image or map of each topic; the last message of each latching publisher. In the
  /// order of arrival, each with the stamp it arrived at.
  std::vector<Message> light(Stamp at) const;
  /// Returns the body's targets: the last goal of each action, unless it was canceled, and the last
  /// trajectory of each command topic. In the order of arrival.
  std::vector<Message> targets() const;

 private:
  struct LiveMarker {
    Message source;  ///< message without bytes
    std::int64_t lifetime_ns = 0;
    Value marker;
  };
  /// Markers by namespace and id.
  using Markers = std::map<std::pair<std::string, std::int32_t>, LiveMarker>;
  struct MarkerTopic {
    std::int64_t channel = 0;  ///< channel of its first message
    bool is_array = false;
    std::optional<Schema> schema;
    Markers markers;
  };

  void addMarkers(const Channel& channel, const Message& message);
  static void addMarker(const Message& message, Value marker, Markers& markers);
  static void addLive(const MarkerTopic& topic, Stamp at, std::vector<Message>& messages);

  std::map<std::string, Message> last_;      ///< last messages by topic
  std::map<std::int64_t, Message> latched_;  ///< latched messages by channel
  std::map<std::string, MarkerTopic> markers_;
  std::map<std::string, Message> targets_;  ///< targets by action or command topic
};

}  // namespace afterglow::replay
