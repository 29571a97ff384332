/// \file
/// The last seconds of what nobody recorded: where a behavior begins that reaches back.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/record/latched_state.hpp"

namespace afterglow::replay {

/// A ring bounded in time and bytes; the oldest goes first. Latched messages that leave it become
/// the latched state that held when it begins, so that the state at any moment within is known.
/// Not thread-safe.
class PreRoll {
 public:
  struct Entry {
    std::size_t channel_index = 0;
    Stamp received;
    std::uint64_t sequence = 0;
    bool is_latched = false;
    bool is_stored = false;  ///< kept for its latched state only
    Bytes bytes;
  };

  PreRoll(std::int64_t longest_ns, std::size_t most_bytes)
      : longest_ns_(longest_ns), most_bytes_(most_bytes) {}

  /// Channels are the caller's list, by index.
  void push(Entry entry, const std::deque<Channel>& channels);
  /// Forgets all but the latched state; no behavior reaches back behind this moment.
  void startAgain(Stamp from, const std::deque<Channel>& channels);
  /// What is remembered stays, but no behavior reaches back behind this moment.
  void limitReach(Stamp from) { complete_since_ = std::max(complete_since_, from); }
  /// A topic that nobody listens to any more.
  void forget(const std::string& topic, const std::deque<Channel>& channels);
  /// How far back a behavior can reach that begins now.
  Stamp reach(Stamp begin, std::int64_t pre_roll_ns) const;
  /// Takes out what came since `from` and was not stored yet, of topics that are wanted.
  std::vector<Entry> take(Stamp from, const std::function<bool(std::size_t channel)>& is_wanted);
  /// What latched topics said at that moment, of topics that are wanted.
  std::vector<LatchedState::Entry> latchedAt(Stamp moment, const std::vector<std::string>& topics,
                                             const std::deque<Channel>& channels) const;

 private:
  void dropFront(const std::deque<Channel>& channels);

  std::int64_t longest_ns_;
  std::size_t most_bytes_;
  std::deque<Entry> entries_;
  std::size_t bytes_ = 0;
  Stamp complete_since_;  ///< nothing that came since is missing
  LatchedState latched_;  ///< in force when entries_ begins
};

}  // namespace afterglow::replay
