/// \file
/// The events on a topic that is listened to: of a layer, and of /tf.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "nodes/projector/topic_monitor.hpp"

namespace afterglow::nodes {

/// The events on a topic, for people.
struct LayerStatus {
  std::string topic;
  std::uint64_t received = 0;  ///< messages
  std::size_t shown = 0;
  std::size_t waiting = 0;  ///< number of those that wait for a transform
  std::string waiting_for;  ///< the frame whose transform is missing, if something waits for it
  std::string missing;      ///< missing part of that transform, in words
  std::string nothing;      ///< the reason why the newest message shows nothing; empty: it shows
                            ///< something
  std::size_t invisible = 0;  ///< drawables of alpha 0 among what is shown
  std::uint64_t expired = 0;  ///< shown until their lifetime was over, ever
  std::string type;                   ///< the configuration's
  std::optional<TopicSource> source;  ///< source of the topic, where the master is asked
  std::map<std::string, std::uint64_t> dropped;  ///< reason -> how often
  std::map<std::string, std::uint64_t> remarks;  ///< shown, but odd

  // Count a reason; distinct ones are bounded: frame names in them come from the network.
  void drop(const std::string& reason);
  void remark(const std::string& reason);
};

}  // namespace afterglow::nodes
