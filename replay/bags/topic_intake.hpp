/// \file
/// The topics of a recording on their way into the store: which are taken, as what, and how many
/// messages were left out. Internal to replay.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/ros2/ros2_topic.hpp"

namespace afterglow::replay {

class TopicIntake {
 public:
  explicit TopicIntake(FindDefinition find) : find_(std::move(find)) {}

  bool knows(std::uint32_t id) const { return topics_.count(id) != 0; }
  /// Adds a channel whose messages are taken as they are, by the known definition if its own is
  /// defective; left out if nobody says which MD5 the type has.
  void addRos1(std::uint32_t id, Channel channel);
  /// Left out if its messages cannot be read.
  void addRos2(std::uint32_t id, const Ros2Description& description);
  void leaveOut(std::uint32_t id, const std::string& topic, const std::string& type,
                const std::string& why);

  /// A message as ROS 1 serializes it; empty: it is left out, which is counted.
  std::optional<Bytes> take(std::uint32_t id, Bytes bytes);
  const Channel& channel(std::uint32_t id) const { return topics_.at(id).channel; }
  /// Returns remarks on what was left out, and on what keeps the fields of ROS 2.
  std::vector<std::string> remarks() const;

 private:
  struct Topic {
    Channel channel;  ///< topic and type alone if it is left out
    std::optional<Ros2Topic> ros2;
    std::string why_not;     ///< all is left out
    std::string why_mended;  ///< the reason why its own definition is defective
    std::uint64_t taken = 0, left_out = 0;
    std::string first_error;
  };

  FindDefinition find_;
  std::map<std::uint32_t, Topic> topics_;
};

}  // namespace afterglow::replay
