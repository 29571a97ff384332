#include "replay/record/pre_roll.hpp"

#include <utility>

namespace afterglow::replay {
namespace {

/// Static transforms of one node that are told apart by their bytes; bounds the memory.
constexpr std::size_t kMostStaticTransformMessages = 256;

}  // namespace

void LatchedState::remember(const Channel& channel, Bytes bytes) {
  std::vector<Entry>& entries = by_topic_[channel.topic];
  const bool keeps_all = channel.topic == "/tf_static";
  const auto replaced = [&](const Entry& entry) {
    return entry.channel->caller_id == channel.caller_id && (!keeps_all || entry.bytes == bytes);
  };
  entries.erase(std::remove_if(entries.begin(), entries.end(), replaced), entries.end());
  if (entries.size() >= kMostStaticTransformMessages) {
    entries.erase(entries.begin());
  }
  entries.push_back({&channel, std::move(bytes)});
}

const std::vector<LatchedState::Entry>& LatchedState::find(const std::string& topic) const {
  static const std::vector<Entry> kNone;
  const auto found = by_topic_.find(topic);
  return found == by_topic_.end() ? kNone : found->second;
}

void PreRoll::push(Entry entry) {
  entry.is_latched = entry.channel->latching;
  if (longest_ns_ == 0) {
    if (entry.is_latched) latched_.remember(*entry.channel, std::move(entry.bytes));
    return;
  }
  const Stamp newest = entry.received;
  bytes_ += entry.bytes.size() + sizeof(Entry);
  entries_.push_back(std::move(entry));
  while (!entries_.empty() &&
         (bytes_ > most_bytes_ || entries_.front().received.ns < newest.ns - longest_ns_)) {
    complete_since_ = std::max(complete_since_, Stamp{entries_.front().received.ns + 1});
    dropFront();
  }
}

void PreRoll::dropFront() {
  Entry& oldest = entries_.front();
  bytes_ -= oldest.bytes.size() + sizeof(Entry);
  if (oldest.is_latched) latched_.remember(*oldest.channel, std::move(oldest.bytes));
  entries_.pop_front();
}

void PreRoll::startAgain(Stamp from) {
  while (!entries_.empty()) dropFront();
  complete_since_ = from;
}

void PreRoll::forget(const std::string& topic) {
  latched_.forget(topic);
  for (Entry& entry : entries_) {
    if (entry.channel->topic == topic) entry.is_latched = false;
  }
}

Stamp PreRoll::reach(Stamp begin, std::int64_t pre_roll_ns) const {
  const std::int64_t back = std::min(pre_roll_ns, longest_ns_);
  return std::min(begin, std::max(Stamp{begin.ns - back}, complete_since_));
}

std::vector<PreRoll::Entry> PreRoll::take(Stamp from, const std::set<std::string>& topics) {
  std::vector<Entry> taken;
  for (Entry& entry : entries_) {
    const bool is_asked = entry.received >= from && topics.count(entry.channel->topic) != 0;
    if (!is_asked || entry.is_stored) continue;
    if (entry.is_latched) {
      taken.push_back(entry);
    } else {
      bytes_ -= entry.bytes.size();
      Bytes bytes = std::exchange(entry.bytes, {});
      taken.push_back(entry);
      taken.back().bytes = std::move(bytes);
    }
    entry.is_stored = true;
  }
  return taken;
}

std::vector<LatchedState::Entry> PreRoll::latchedAt(Stamp moment,
                                                    const std::set<std::string>& topics) const {
  LatchedState state;
  for (const std::string& topic : topics) {
    for (const LatchedState::Entry& entry : latched_.find(topic)) {
      state.remember(*entry.channel, entry.bytes);
    }
  }
  for (const Entry& entry : entries_) {
    const bool is_asked = entry.received < moment && topics.count(entry.channel->topic) != 0;
    if (is_asked && entry.is_latched) state.remember(*entry.channel, entry.bytes);
  }
  std::vector<LatchedState::Entry> in_force;
  for (const std::string& topic : topics) {
    const auto& entries = state.find(topic);
    in_force.insert(in_force.end(), entries.begin(), entries.end());
  }
  return in_force;
}

}  // namespace afterglow::replay
