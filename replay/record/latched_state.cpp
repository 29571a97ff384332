#include "replay/record/latched_state.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

/// Static transforms of one node that are told apart by their bytes; bounds the memory.
constexpr std::size_t kMostStaticTransformMessages = 256;

}  // namespace

void LatchedState::remember(std::size_t channel_index, const Channel& channel, Bytes bytes) {
  caller_of_.emplace(channel_index, channel.caller_id);
  std::vector<Entry>& entries = by_topic_[channel.topic];
  const bool keeps_all = channel.topic == "/tf_static";
  const auto replaced = [&](const Entry& entry) {
    return caller_of_[entry.channel_index] == channel.caller_id &&
           (!keeps_all || entry.bytes == bytes);
  };
  entries.erase(std::remove_if(entries.begin(), entries.end(), replaced), entries.end());
  if (entries.size() >= kMostStaticTransformMessages) {
    entries.erase(entries.begin());
  }
  entries.push_back({channel_index, std::move(bytes)});
}

void LatchedState::forget(const std::string& topic) { by_topic_.erase(topic); }

const std::vector<LatchedState::Entry>* LatchedState::find(const std::string& topic) const {
  const auto found = by_topic_.find(topic);
  return found == by_topic_.end() ? nullptr : &found->second;
}

}  // namespace afterglow::replay
