/// \file
/// The publishers of the topics that a node listens to, and their types: a subscription to another
/// type than the publisher's stays silent, and roscpp says so in the publisher's log alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
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

/// The events on a topic, for people.
struct LayerStatus {
  std::string topic;
  std::uint64_t received = 0;  ///< messages
  std::size_t shown = 0;
  std::size_t waiting = 0;    ///< number of those that wait for a transform
  std::string waiting_for;    ///< the frame whose transform is missing, if something waits for it
  std::string missing;        ///< missing part of that transform, in words
  std::string nothing;        ///< reason if the newest message shows nothing
  std::size_t invisible = 0;  ///< drawables of alpha 0 among what is shown
  std::uint64_t expired = 0;  ///< shown until their lifetime was over, ever
  std::string type;           ///< the configuration's
  std::optional<TopicSource> source;             ///< source of the topic, where the master is asked
  std::map<std::string, std::uint64_t> dropped;  ///< reason -> how often
  std::map<std::string, std::uint64_t> remarks;  ///< shown, but odd

  // Count a reason; distinct ones are bounded: frame names in them come from the network.
  void drop(const std::string& reason);
  void remark(const std::string& reason);
};

}  // namespace afterglow::nodes
