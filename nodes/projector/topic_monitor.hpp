/// \file
/// The publishers of the topics that a node listens to, and their types: a subscription to another
/// type than the publisher's stays silent, and roscpp says so in the publisher's log alone.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "replay/clock/worker_thread.hpp"

namespace afterglow::nodes {

/// The master's knowledge of a topic.
struct TopicSource {
  std::vector<std::string> publishers;  ///< nodes
  std::string type;                     ///< type of the latest publisher; empty: unknown
};
/// Sources by topic. A topic that the master does not know is there, without publishers.
using TopicSources = std::map<std::string, TopicSource>;

/// Asks the master in a thread of its own, now and then: a master that hangs delays nobody.
class TopicMonitor {
 public:
  explicit TopicMonitor(std::vector<std::string> topics);

  /// Returns the sources as of the last answer; empty while there is none. Any thread.
  TopicSources sources() const;

 private:
  void look();

  const std::vector<std::string> topics_;
  mutable std::mutex mutex_;  ///< guards what follows
  TopicSources sources_;
  replay::RepeatingThread thread_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
