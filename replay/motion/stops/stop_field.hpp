/// \file
/// The boolean field, of messages of any type, that says whether the robot has to stop.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "replay/messages/field_edit.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

/// Paths of all booleans of a message, "runstopped", "a.b", "flags[]", in the definition's order.
std::vector<std::string> booleanFields(const Schema& schema);

/// Reads the field of one message after the other; one thread.
class StopField {
 public:
  /// `path` as booleanFields() gives it; empty: the type has one boolean alone, as std_msgs/Bool
  /// has. `stops_when`: the value that stops the robot; of an array's elements one is enough.
  StopField(std::string path, bool stops_when)
      : path_(std::move(path)), stops_when_(stops_when) {}

  /// Returns true if the robot has to stop. Throws MessageError, one line for people, if the type
  /// has no such field, the bytes do not fit the type, or an array is empty.
  bool stops(const std::string& type, const std::string& definition, const Bytes& bytes);

 private:
  void prepare(const std::string& type, const std::string& definition);

  const std::string path_;
  const bool stops_when_;
  std::string type_, definition_;  ///< the finder's type and definition
  std::optional<FieldFinder> finder_;
};

}  // namespace afterglow::replay
