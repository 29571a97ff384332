/// \file
/// Messages as nodes of ROS 2 serialize them. Internal to replay. Source of the format: OMG
/// DDSI-RTPS 2.5, 10 (XCDR version 1: numbers are aligned to their size, counted from behind the
/// encapsulation header's 4 bytes).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

/// Turns messages of one type into what ROS 1 serializes. A value; safe from any thread.
class CdrMessage {
 public:
  /// `schema` is the ROS 1 definition's (ros2_definition.hpp): std_msgs/Header has `seq`, which
  /// ROS 2 has not and which becomes 0.
  explicit CdrMessage(Schema schema);

  /// Little or big endian. Throws MessageError naming field and byte for bytes that are no message
  /// of the type, and for a time before 1970, which ROS 1 has not.
  Bytes toRos1(const std::uint8_t* bytes, std::size_t size) const;

  const Schema& schema() const { return schema_; }

 private:
  friend class CdrWalk;
  /// The size of a type all of whose parts are numbers of one size, so that an array of it is one
  /// piece.
  struct Uniform {
    std::size_t number_size = 0;  ///< 0: it is none
    std::size_t size = 0;         ///< size of the whole
  };
  void measure(std::size_t type, std::vector<bool>& is_known);
  Uniform uniformOf(const MessageType& type) const;

  Schema schema_;
  std::vector<Uniform> uniform_;  ///< sizes by type
  std::vector<bool> is_header_;   ///< a flag for each type
};

}  // namespace afterglow::replay
