/// \file
/// Edits fields of a serialized message in place, without decoding the rest: what replay needs to
/// give old messages new stamps, ids and frames.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

/// "header.stamp", "transforms[].header.stamp", "points[3].x": names joined by '.'; [] means every
/// element, [n] one element (0-based). An array is named by its elements, never as a whole.
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

/// The place of a field's value in a message.
struct FieldSpan {
  FieldType type;
  std::size_t offset = 0;
  std::size_t size = 0;  ///< size; a String's includes its 4-byte length
};

/// Finds fields in many messages of one schema; resolves their paths only once. Keeps a copy of the
/// schema; safe from any thread.
class FieldFinder {
 public:
  /// Throws MessageError if the schema has no such field.
  FieldFinder(Schema schema, const std::vector<FieldPath>& paths);
  FieldFinder(const Schema& schema, const FieldPath& path);
  ~FieldFinder();
  FieldFinder(FieldFinder&&) noexcept;
  FieldFinder& operator=(FieldFinder&&) noexcept;

  /// Returns a list of places for each path, in the order of the constructor's paths; the whole
  /// message is walked once. Throws MessageError if the bytes do not fit the schema.
  std::vector<std::vector<FieldSpan>> find(const Bytes& bytes) const;

 private:
  struct Node;
  Schema schema_;
  std::size_t path_count_;
  std::unique_ptr<Node> root_;
};

/// All places that the path names, in order; empty for an index beyond an array's end.
/// Throws MessageError if the schema has no such field, or the bytes do not fit the schema.
std::vector<FieldSpan> findField(const Schema& schema, const Bytes& bytes, const FieldPath& path);

/// The stamp a Time span holds; empty if the span is of another type.
std::optional<Stamp> readTime(const Bytes& bytes, const FieldSpan& span);
/// Throws MessageError if the span is no String.
std::string readString(const Bytes& bytes, const FieldSpan& span);

/// The first String that the path names; empty if there is none.
std::string stringAt(const Schema& schema, const Bytes& bytes, std::string_view path);

/// Overwrites a time in place. Throws MessageError if the span is of another type, or for a stamp
/// that ROS time cannot hold (negative, or 2^32 s and later).
void writeTime(Bytes& bytes, const FieldSpan& span, Stamp stamp);

/// Replaces every string the path names by `edit`'s result; the message grows or shrinks.
/// Returns how many strings changed.
std::size_t editStrings(const Schema& schema, Bytes& bytes, const FieldPath& path,
                        const std::function<std::string(const std::string&)>& edit);
/// The same for spans that were found in these bytes; in ascending order.
std::size_t editStrings(Bytes& bytes, const std::vector<FieldSpan>& spans,
                        const std::function<std::string(const std::string&)>& edit);

/// True if the bytes are a message of this schema, from the first to the last.
bool fits(const Schema& schema, const Bytes& bytes);

/// The stamp of the outermost message's header, if its first field is a std_msgs/Header. Throws
/// MessageError if the bytes end within it.
std::optional<Stamp> headerStamp(const Schema& schema, const Bytes& bytes);

}  // namespace afterglow::replay
