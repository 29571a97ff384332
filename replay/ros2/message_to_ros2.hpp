/// \file
/// Messages of ROS 1 as readers of ROS 2 ask for them.
#pragma once

#include <string>

#include "replay/messages/definitions.hpp"
#include "replay/messages/message.hpp"
#include "replay/ros2/ros2_topic.hpp"

namespace afterglow::replay {

/// Turns messages of one type into those of the same type of ROS 2, or of the other Twist.
class MessageToRos2 {
 public:
  struct Wanted {
    std::string topic;
    std::string type;        ///< "geometry_msgs/msg/Twist"
    std::string definition;  ///< of it, ROS 2's; empty: not told
  };

  /// Throws MessageError, which says why, if messages of `ros1_type`, as `definition` has it,
  /// cannot be turned into what is wanted.
  MessageToRos2(const Wanted& wanted, const std::string& ros1_type, const Definition& definition);

  static bool isPossible(const std::string& ros1_type, const std::string& ros2_type);
  /// `now` stamps what had no stamp. Throws MessageError for bytes that are no message of the type.
  Bytes convert(const Bytes& bytes, Stamp now) const;

 private:
  std::string ros1_type_;
  Ros2Topic topic_;
};

}  // namespace afterglow::replay
