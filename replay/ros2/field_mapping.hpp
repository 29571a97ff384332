/// \file
/// Messages of one definition as those of another of the same name. Internal to replay.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

/// Copies each field of a ROS 1 type from the field of that name and type, or the one that ROS 2
/// renamed, in the message of ROS 2. Constants and the order of fields do not matter. A value.
class FieldMapping {
 public:
  /// Throws MessageError, which says why, if a field has no such source, or if fields would be lost
  /// of a type that is not only looked at (visualization_msgs).
  FieldMapping(Schema from, Schema to);

  /// Throws MessageError if the bytes do not fit `from`.
  Bytes map(const Bytes& bytes) const;

 private:
  void check(std::size_t to_type, std::size_t from_type, const std::string& path) const;
  Value mapMessage(Value& from, std::size_t to_type) const;
  Value mapField(Value& from, const Field& field) const;

  Schema from_, to_;
};

}  // namespace afterglow::replay
