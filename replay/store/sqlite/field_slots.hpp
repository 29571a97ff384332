/// \file
/// The scalar fields of a message type that the field index knows, numbered in the order of the
/// definition. Internal to replay/store.
#pragma once

#include <limits>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "replay/messages/schema.hpp"

namespace afterglow::replay {

/// The numbers are on disk: they change only with the version of the format.
class FieldSlots {
 public:
  /// Only the first so many scalar fields are indexed.
  static constexpr std::size_t kMost = 256;
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

  /// A field of a message and the slots of its values. Times have two slots, secs and nsecs.
  struct Step {
    const Field* field = nullptr;
    std::size_t slot = kNone;  ///< of a scalar; kNone: not indexed
    /// Of an array that is too long for a document, which has {"type", "count"} instead.
    std::size_t type_slot = kNone, count_slot = kNone;
    std::vector<Step> below;  ///< of a message; empty: not indexed
  };

  explicit FieldSlots(Schema schema);
  FieldSlots(const FieldSlots&) = delete;  // steps point into the schema
  FieldSlots& operator=(const FieldSlots&) = delete;

  const Schema& schema() const { return schema_; }
  const std::vector<Step>& steps() const { return steps_; }
  std::size_t size() const { return slots_.size(); }

  enum class Place { Slot, Unknown, Nowhere };
  struct Found {
    Place place;  ///< Nowhere: no document has a value there
    std::size_t slot = kNone;
    bool is_array = false;   ///< an array of scalars: it exists even if it has no values
    bool has_index = false;  ///< the path names one element of an array
  };
  /// The slot of a filter's path; indices in it are ignored.
  Found find(const std::string& path) const;

 private:
  std::vector<Step> stepsOf(std::size_t type_index, const std::string& prefix);
  Step stepOf(const Field& field, const std::string& path);
  std::size_t slotOf(const std::string& path, bool is_array);

  struct Slot {
    std::size_t number;
    bool is_array;
  };
  Schema schema_;
  std::unordered_map<std::string, Slot> slots_;
  std::unordered_set<std::string> groups_;  ///< paths of messages and times
  bool is_full_ = false;
  std::vector<Step> steps_;
};

}  // namespace afterglow::replay
