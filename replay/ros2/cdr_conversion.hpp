/// \file
/// Messages as nodes of ROS 2 serialize them, and as those of ROS 1 do. Internal to replay. Source
/// of the format: OMG DDSI-RTPS 2.5, 10 (XCDR version 1: numbers are aligned to their size, counted
/// from behind the encapsulation header's 4 bytes).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "replay/ros2/ros2_definition.hpp"

namespace afterglow::replay {

/// Converts the messages of one type both ways, by a plan that is made once: numbers that lie alike
/// are copied as one piece. Each field goes with the one of its name and type, or with the one that
/// ROS 2 renamed; their order does not matter. std_msgs/Header's `seq`, which ROS 2 has not,
/// becomes 0. Fields that ROS 2 alone has are written as zeros where they are allowed. A value;
/// safe from any thread.
class CdrConversion {
 public:
  /// Fields that ROS 2 alone has. Refused: but in types that are only looked at
  /// (visualization_msgs), which lose them. Empty: allowed where empty means none (lists, and
  /// messages of lists behind a header), and refused in messages that have something there.
  /// PassedOver: all of them are lost.
  enum class Extra { Refused, Empty, PassedOver };
  /// Both schemas are ROS 1's: `ros2` that of ros1Definition(), `ros1` that of the type's own
  /// definition. Throws MessageError, which says why, if a field has no partner.
  CdrConversion(Schema ros2, Schema ros1, const Ros2Bounds& bounds = {},
                Extra extra = Extra::Refused);

  /// Bytes behind the last field. rclpy's serialize_message() leaves some that mean nothing; where
  /// the definition is a guess, they tell that it is wrong.
  enum class Rest { Refused, Ignored };
  /// Reads little or big endian. Throws MessageError naming field and byte for bytes that are no
  /// message of the type, and for a time before 1970, which ROS 1 has not.
  Bytes toRos1(const Bytes& cdr, Rest rest = Rest::Refused) const;
  /// Writes little endian. Throws MessageError naming field and byte for bytes that are no message
  /// of the type, for a time after 2038, which ROS 2 has not, and for more elements or letters than
  /// ROS 2's definition allows.
  Bytes toRos2(const Bytes& ros1) const;

 private:
  template <typename From, typename To>
  friend class CdrWalk;
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

  /// A field with its partner: places in their types' lists of fields.
  struct Link {
    std::size_t ros2 = kNone, ros1 = kNone;  ///< kNone: `seq`; what ROS 2 alone has
    std::size_t type = kNone;                ///< place in `types_` if it is a message
    Ros2Bound bound;
  };
  /// A type all of whose parts are numbers of one size, so that an array of it is one piece.
  struct Uniform {
    std::size_t number_size = 0;  ///< 0: it is none
    std::size_t size = 0;         ///< size of the whole
  };
  struct Type {
    std::size_t ros2, ros1;   ///< places in the schemas' types
    std::vector<Link> links;  ///< in ROS 2's order, `seq` first
    std::vector<Link> in_ros1_order;
    bool is_in_order = true;  ///< both have their fields in the same order
    Uniform uniform;
  };

  std::size_t plan(std::size_t ros2, std::size_t ros1, const std::string& path,
                   const Ros2Bounds& bounds);
  Link linkOf(const Type& type, std::size_t ros2, const std::string& path,
              const Ros2Bounds& bounds);
  bool isAllowedExtra(const MessageType& owner, const Field& field) const;
  void checkAllFound(const Type& type, const std::string& path) const;
  Uniform uniformOf(const Type& type) const;
  Uniform uniformOf(const Field& field, const Link& link) const;

  Schema ros2_, ros1_;
  Extra extra_;
  std::vector<Type> types_;  ///< [0] is the outermost
};

}  // namespace afterglow::replay
