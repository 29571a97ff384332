/// \file
/// The publishers of the topics that a node listens to, and their types: a subscription to another
/// type than the publisher's stays silent, and roscpp says so in the publisher's log alone.
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace afterglow::nodes {

/// The master's knowledge of a topic.
struct TopicSource {
  std::vector<std::string> publishers;  ///< nodes
  std::string type;                     ///< type of the latest publisher; empty: unknown
};
/// Sources by topic. A topic that the master does not know is there, without publishers.
using TopicSources = std::map<std::string, TopicSource>;

/// Asks the master in a thread of its own, now and then: a master that hangs delays nobody.
class TopicWatch {
 public:
  explicit TopicWatch(std::vector<std::string> topics);
  TopicWatch(const TopicWatch&) = delete;
  TopicWatch& operator=(const TopicWatch&) = delete;
  ~TopicWatch();

  /// Returns the sources as of the last answer; empty while there is none. Any thread.
  TopicSources sources() const;

 private:
  void run();

  const std::vector<std::string> topics_;
  mutable std::mutex mutex_;  ///< guards what follows
  std::condition_variable stopped_;
  bool is_stopped_ = false;
  TopicSources sources_;
  std::thread thread_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
