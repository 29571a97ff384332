/// \file
/// Reads serialized ROS messages: a cursor that never leaves the bytes and names the present field
/// in error texts. Internal to replay. Source of the wire format:
/// wiki.ros.org/ROS/Technical%20Overview, genpy and roscpp_serialization.
#pragma once

#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

// ROS serializes little endian; numbers are copied, not converted.
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "replay needs a little-endian machine");

template <typename T>
T loadNumber(const std::uint8_t* from) {
  static_assert(std::is_arithmetic_v<T>);
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

template <typename T>
void storeNumber(std::uint8_t* to, T value) {
  static_assert(std::is_arithmetic_v<T>);
  std::memcpy(to, &value, sizeof(T));
}

/// True for numbers and bool, whose arrays are NumberArrays in a document.
inline bool isNumber(FieldType type) {
  return fixedSize(type) > 0 && type != FieldType::Time && type != FieldType::Duration;
}

/// Returns f(T()) for the C++ type T of a field type's numbers. Throws MessageError for bool, which
/// is a number only on the wire, and for types that are no numbers.
template <typename F>
auto withNumber(FieldType type, const F& f) {
  switch (type) {
    case FieldType::Int8:
      return f(std::int8_t{});
    case FieldType::UInt8:
      return f(std::uint8_t{});
    case FieldType::Int16:
      return f(std::int16_t{});
    case FieldType::UInt16:
      return f(std::uint16_t{});
    case FieldType::Int32:
      return f(std::int32_t{});
    case FieldType::UInt32:
      return f(std::uint32_t{});
    case FieldType::Int64:
      return f(std::int64_t{});
    case FieldType::UInt64:
      return f(std::uint64_t{});
    case FieldType::Float32:
      return f(float{});
    case FieldType::Float64:
      return f(double{});
    default:
      throw MessageError(std::string(name(type)) + " is no type of numbers");
  }
}

/// Walks one message from its first byte to its last. Instead of reading or allocating beyond the
/// bytes, every method throws MessageError naming type, field and offset. Keeps references to
/// schema and bytes.
class WireReader {
 public:
  /// Refuses bytes that are fewer than any message of the schema has.
  WireReader(const Schema& schema, const Bytes& bytes);

  std::size_t offset() const { return offset_; }
  std::size_t left() const { return bytes_.size() - offset_; }
  void seek(std::size_t offset) { offset_ = offset; }

  /// The next `size` bytes.
  const std::uint8_t* take(std::size_t size);
  template <typename T>
  T number() {
    return loadNumber<T>(take(sizeof(T)));
  }
  std::string string();
  /// Reads how many elements the field has here, checked against the remaining bytes.
  std::size_t count(const Field& field);

  void skipField(const Field& field);
  void skipElement(const Field& field);
  /// Refuses bytes behind the message.
  void finish() const;

  /// Sets the field, and the element of it, that error texts name.
  void enter(const Field& field) { path_.push_back({&field, 0}); }
  void atElement(std::size_t index) { path_.back().index = index; }
  void leave() { path_.pop_back(); }
  [[noreturn]] void fail(const std::string& what) const;

 private:
  struct Place {
    const Field* field;
    std::size_t index;
  };
  void skipMessage(std::size_t type_index);
  std::size_t minimumSize(const Field& field) const;

  const Schema& schema_;
  const Bytes& bytes_;
  std::size_t offset_ = 0;
  std::vector<Place> path_;  ///< places from the outermost field inwards
};

}  // namespace afterglow::replay
