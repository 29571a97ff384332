/// \file
/// What latched topics currently say: the messages that a subscriber who came now would get.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// Keeps the last message of every (topic, publishing node). On /tf_static it keeps every distinct
/// message of a node instead (up to a bound, newest first to stay): a node may publish several
/// static transforms one by one, and all of them hold. Not thread-safe.
class LatchedState {
 public:
  struct Entry {
    std::size_t channel_index = 0;
    Bytes bytes;
  };

  void remember(std::size_t channel_index, const Channel& channel, Bytes bytes);
  void forget(const std::string& topic);
  /// In the order of arrival.
  const std::vector<Entry>* find(const std::string& topic) const;

 private:
  /// Few publishers latch one topic: a plain list in order of arrival is enough.
  std::map<std::string, std::vector<Entry>> by_topic_;
  std::map<std::size_t, std::string> caller_of_;  ///< by channel index
};

}  // namespace afterglow::replay
