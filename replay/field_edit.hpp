/// \file
/// Edits fields of a serialized message in place, without decoding the rest: what replay needs to
/// give old messages new stamps, ids and frames.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "replay/message.hpp"
#include "replay/schema.hpp"

namespace afterglow::replay {

/// "header.stamp", "transforms[].header.stamp", "points[3].x": names joined by '.'; [] means every
/// element, [n] one element (0-based).
class FieldPath {
 public:
  struct Step {
    std::string name;
    enum class Index { None, One, Each } index = Index::None;
    std::size_t at = 0;
  };
  /// Throws MessageError for a malformed path.
  static FieldPath parse(std::string_view text);
  const std::vector<Step>& steps() const { return steps_; }
  std::string str() const;

 private:
  std::vector<Step> steps_;
};

/// Where a field's value lies in a message.
struct FieldSpan {
  FieldType type;
  std::size_t offset = 0;
  std::size_t size = 0;  ///< for String: with its 4-byte length
};

/// Every place the path names, in order; none for an index beyond an array's end or empty arrays.
/// Throws MessageError if the schema has no such field, or the bytes do not fit the schema.
std::vector<FieldSpan> findField(const Schema& schema, const Bytes& bytes, const FieldPath& path);

/// True if the schema has the field (whatever a message holds).
bool hasField(const Schema& schema, const FieldPath& path);

std::optional<Stamp> readTime(const Bytes& bytes, const FieldSpan& span);
std::string readString(const Bytes& bytes, const FieldSpan& span);

/// Overwrite in place. Throw MessageError when the span is of another type; writeTime also for a
/// stamp that ROS time cannot hold (negative, or 2^32 s and later).
void writeTime(Bytes& bytes, const FieldSpan& span, Stamp stamp);
void writeNumber(Bytes& bytes, const FieldSpan& span, double value);

/// Replaces every string the path names by `edit`'s result; the message grows or shrinks.
/// Returns how many changed.
std::size_t editStrings(const Schema& schema, Bytes& bytes, const FieldPath& path,
                        const std::function<std::string(const std::string&)>& edit);

/// Every time field of a schema that is a stamp for replay's purposes: all `time` fields, nested and
/// in arrays, as paths with [] ("transforms[].header.stamp").
std::vector<FieldPath> timeFields(const Schema& schema);

/// header.stamp of the outermost message, if its first field is a std_msgs/Header.
std::optional<Stamp> headerStamp(const Schema& schema, const Bytes& bytes);

}  // namespace afterglow::replay
