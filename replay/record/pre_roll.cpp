#include "replay/record/pre_roll.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {

void PreRoll::push(Entry entry, const std::deque<Channel>& channels) {
  const Stamp newest = entry.received;
  if (longest_ns_ == 0) {
    if (entry.is_latched) {
      latched_.remember(entry.channel_index, channels[entry.channel_index], std::move(entry.bytes));
    }
    return;
  }
  bytes_ += entry.bytes.size() + sizeof(Entry);
  entries_.push_back(std::move(entry));
  while (!entries_.empty() &&
         (bytes_ > most_bytes_ || entries_.front().received.ns < newest.ns - longest_ns_)) {
    complete_since_ = std::max(complete_since_, Stamp{entries_.front().received.ns + 1});
    dropFront(channels);
  }
}

void PreRoll::dropFront(const std::deque<Channel>& channels) {
  Entry& oldest = entries_.front();
  bytes_ -= oldest.bytes.size() + sizeof(Entry);
  if (oldest.is_latched) {
    latched_.remember(oldest.channel_index, channels[oldest.channel_index],
                      std::move(oldest.bytes));
  }
  entries_.pop_front();
}

void PreRoll::startAgain(Stamp from, const std::deque<Channel>& channels) {
  while (!entries_.empty()) dropFront(channels);
  complete_since_ = from;
}

void PreRoll::forget(const std::string& topic, const std::deque<Channel>& channels) {
  latched_.forget(topic);
  for (Entry& entry : entries_) {
    if (channels[entry.channel_index].topic == topic) entry.is_latched = false;
  }
}

Stamp PreRoll::reach(Stamp begin, std::int64_t pre_roll_ns) const {
  const std::int64_t back = std::min(pre_roll_ns, longest_ns_);
  return std::min(begin, std::max(Stamp{begin.ns - back}, complete_since_));
}

std::vector<PreRoll::Entry> PreRoll::take(
    Stamp from, const std::function<bool(std::size_t channel)>& is_wanted) {
  std::vector<Entry> taken;
  for (Entry& entry : entries_) {
    if (entry.received < from || entry.is_stored || !is_wanted(entry.channel_index)) continue;
    taken.push_back(entry.is_latched ? entry : std::move(entry));
    entry.is_stored = true;
    if (!entry.is_latched) {
      bytes_ -= taken.back().bytes.size();
      entry.bytes.clear();
    }
  }
  return taken;
}

std::vector<LatchedState::Entry> PreRoll::latchedAt(Stamp moment,
                                                    const std::vector<std::string>& topics,
                                                    const std::deque<Channel>& channels) const {
  LatchedState state;
  const auto is_asked = [&](const std::string& topic) {
    return std::find(topics.begin(), topics.end(), topic) != topics.end();
  };
  for (const std::string& topic : topics) {
    if (const auto* entries = latched_.find(topic)) {
      for (const LatchedState::Entry& entry : *entries) {
        state.remember(entry.channel_index, channels[entry.channel_index], entry.bytes);
      }
    }
  }
  for (const Entry& entry : entries_) {
    const Channel& channel = channels[entry.channel_index];
    if (entry.is_latched && entry.received < moment && is_asked(channel.topic)) {
      state.remember(entry.channel_index, channel, entry.bytes);
    }
  }
  std::vector<LatchedState::Entry> in_force;
  for (const std::string& topic : topics) {
    if (const auto* entries = state.find(topic)) {
      in_force.insert(in_force.end(), entries->begin(), entries->end());
    }
  }
  return in_force;
}

}  // namespace afterglow::replay
