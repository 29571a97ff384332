/// \file
/// The messages of the last seconds that no behavior recorded, for behaviors that reach back.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// The messages that a subscriber who came now would get of latched topics: the last one of every
/// (topic, publishing node). On /tf_static every distinct message of a node instead (up to a bound,
/// the oldest goes): a node may publish several static transforms one by one, and all of them hold.
/// Channels must outlive it. Not thread-safe.
class LatchedState {
 public:
  struct Entry {
    const Channel* channel = nullptr;
    Bytes bytes;
  };

  void remember(const Channel& channel, Bytes bytes);
  void forget(const std::string& topic) { by_topic_.erase(topic); }
  /// Returns the messages on a topic in the order of arrival.
  const std::vector<Entry>& find(const std::string& topic) const;

 private:
  /// Few publishers latch one topic: a plain list in order of arrival is enough.
  std::map<std::string, std::vector<Entry>> by_topic_;
};

/// A ring bounded in time and bytes; the oldest goes first. Latched messages that leave it become
/// the latched state that held when it begins, so that the state at any moment within is known.
/// Channels must outlive it. Not thread-safe.
class PreRoll {
 public:
  struct Entry {
    const Channel* channel = nullptr;
    Stamp received;
    std::uint64_t sequence = 0;
    bool is_stored = false;  ///< kept for its latched state only
    Bytes bytes;
    bool is_latched = false;  ///< part of the latched state; filled in by push()
  };

  PreRoll(std::int64_t longest_ns, std::size_t most_bytes)
      : longest_ns_(longest_ns), most_bytes_(most_bytes) {}

  void push(Entry entry);
  /// Forgets all but the latched state; no behavior reaches back behind this moment.
  void startAgain(Stamp from);
  /// The messages stay, but no behavior reaches back behind this moment.
  void limitReach(Stamp from) { complete_since_ = std::max(complete_since_, from); }
  /// A topic that nobody listens to any more.
  void forget(const std::string& topic);
  /// Returns how far back a behavior can reach that begins now.
  Stamp reach(Stamp begin, std::int64_t pre_roll_ns) const;
  /// Takes out the messages of these topics since `from` that were not stored yet.
  std::vector<Entry> take(Stamp from, const std::set<std::string>& topics);
  /// The latched messages that held on these topics at that moment.
  std::vector<LatchedState::Entry> latchedAt(Stamp moment,
                                             const std::set<std::string>& topics) const;

 private:
  void dropFront();

  std::int64_t longest_ns_;
  std::size_t most_bytes_;
  std::deque<Entry> entries_;
  std::size_t bytes_ = 0;
  Stamp complete_since_;  ///< no message since then is missing
  LatchedState latched_;  ///< state in force when entries_ begins
};

}  // namespace afterglow::replay
