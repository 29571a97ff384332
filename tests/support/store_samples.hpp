/// \file
/// Small messages with small stamps for tests of stores and bags.
#pragma once

#include <string>
#include <vector>

#include "replay/store/store.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

inline replay::Channel stringChannel(const std::string& topic,
                                     const std::string& caller_id = "/talker",
                                     bool latching = false) {
  return {topic,           "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1",
          "string data\n", latching,          caller_id};
}

/// A serialized std_msgs/String; characters of `text` as they are.
inline replay::Bytes stringBytes(const std::string& text) {
  const auto size = static_cast<std::uint32_t>(text.size());
  replay::Bytes bytes;
  for (int shift = 0; shift < 32; shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>(size >> shift));
  }
  bytes.insert(bytes.end(), text.begin(), text.end());
  return bytes;
}

inline replay::Message stringMessage(std::int64_t channel, std::int64_t received_ns,
                                     std::uint64_t sequence, const std::string& text) {
  return {channel, replay::Stamp{received_ns}, sequence, {}, stringBytes(text)};
}

inline std::string textOf(const replay::Message& message) {
  return {message.bytes.begin() + 4, message.bytes.end()};
}

inline std::vector<replay::Message> readAll(replay::MessageCursor& cursor) {
  std::vector<replay::Message> messages;
  while (auto message = cursor.next()) messages.push_back(std::move(*message));
  return messages;
}

inline std::vector<std::string> readTexts(const replay::Store& store,
                                          const replay::Behavior& behavior,
                                          const replay::MessageRange& range = {}) {
  std::vector<std::string> texts;
  for (const auto& message : readAll(*store.messages(behavior, range))) {
    texts.push_back(textOf(message));
  }
  return texts;
}

/// A behavior over [begin, end) of a recording.
inline replay::Behavior sampleBehavior(std::int64_t recording, std::vector<std::string> topics,
                                       std::int64_t begin_ns, std::int64_t end_ns) {
  replay::Behavior behavior;
  behavior.recording = recording;
  behavior.name = "pick";
  behavior.begin = {begin_ns};
  behavior.end = replay::Stamp{end_ns};
  behavior.topics = std::move(topics);
  return behavior;
}

/// What completes a recorded behavior (Recorder::end()) with this outcome.
inline auto outcome(const std::string& word) {
  return [word](replay::Behavior& behavior, const auto&) { behavior.outcome = word; };
}

/// Sets a behavior's end and outcome.
inline void endBehavior(replay::Store& store, std::int64_t id, replay::Stamp end,
                        const std::string& outcome) {
  replay::Behavior behavior = store.behavior(id).value();
  behavior.end = end;
  behavior.outcome = outcome;
  store.updateBehavior(behavior);
}

}  // namespace afterglow::test
