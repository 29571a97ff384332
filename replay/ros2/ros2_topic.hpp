/// \file
/// A topic of ROS 2 as one of ROS 1. Internal to replay.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/definitions.hpp"
#include "replay/messages/message.hpp"
#include "replay/ros2/cdr_conversion.hpp"

namespace afterglow::replay {

/// A topic as a recording describes it.
struct Ros2Description {
  std::string topic, type;      ///< "geometry_msgs/msg/Twist"
  std::string serialization;    ///< "cdr"
  std::string definition_kind;  ///< "ros2msg", others are not understood; empty: there is none
  std::string definition;
  std::string quality;  ///< offered_qos_profiles, YAML
};

/// Turns messages into those of the ROS 1 type if that is known and has the same fields, or all of
/// them (CdrConversion); else they keep the fields of ROS 2, and the definition is marked
/// (markAsForeign()), so that they can be looked at and are not sent to a robot of ROS 1.
class Ros2Topic {
 public:
  /// A recording, or a robot that runs: what comes from it may go back to it. So a type that ROS 1
  /// does not know is its own and not marked, and where nothing tells of a type, ROS 1's of that
  /// name is taken.
  enum class Source { Recording, Robot };

  /// Throws MessageError, which says why, if its messages cannot be read.
  Ros2Topic(const Ros2Description& description, const FindDefinition& find,
            Source source = Source::Recording);

  const Channel& channel() const { return channel_; }
  /// The fault of its own definition, for which the known one is taken; empty: there is none.
  const std::string& whyMended() const { return why_mended_; }
  /// The reason why its messages stay with the fields of ROS 2; empty: they do not.
  const std::string& whyForeign() const { return why_foreign_; }
  /// Throws MessageError if the bytes are none of the type's messages.
  Bytes toRos1(const Bytes& bytes);
  /// The other way round, in the newest layout. Throws MessageError likewise.
  Bytes toRos2(const Bytes& bytes) const { return layouts_.front().toRos2(bytes); }

 private:
  void readOwn(const Ros2Description& description, const std::optional<Definition>& known);
  void readKnown(const std::optional<Definition>& known, const std::string& why_not_own);

  Source source_;
  Channel channel_;
  std::string why_foreign_, why_mended_;
  /// Layouts that a message may have; once one alone fits, the others are gone.
  std::vector<CdrConversion> layouts_;
  CdrConversion::Rest rest_ = CdrConversion::Rest::Refused;
};

}  // namespace afterglow::replay
