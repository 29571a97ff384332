/// \file
/// A decoded message: a tree of values that encodes back to the same bytes, bit for bit (NaN
/// payloads, booleans that are neither 0 nor 1, strings that are no UTF-8).
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

struct RosTime {
  std::uint32_t sec = 0, nsec = 0;
};
struct RosDuration {
  std::int32_t sec = 0, nsec = 0;
};

class Value;
using Object = std::vector<std::pair<std::string, Value>>;  ///< fields in the definition's order
using Array = std::vector<Value>;                           ///< strings, times, messages

/// Array of numbers, kept as the bytes they came in: little endian, elements of `type`.
struct NumberArray {
  FieldType type = FieldType::UInt8;
  Bytes bytes;
  std::size_t size() const { return bytes.size() / fixedSize(type); }
};

/// A bool keeps its byte.
struct BoolByte {
  std::uint8_t byte = 0;
};

class Value
    : public std::variant<BoolByte, std::int8_t, std::uint8_t, std::int16_t, std::uint16_t,
                          std::int32_t, std::uint32_t, std::int64_t, std::uint64_t, float, double,
                          std::string, RosTime, RosDuration, NumberArray, Array, Object> {
 public:
  using variant::variant;
};

/// The fields of a message that somebody reads: those below, by name; all if none is named.
struct WantedFields {
  std::string name;
  std::vector<WantedFields> below;

  /// The field at a path of names ("goal.trajectory"), with everything in it.
  void add(const std::vector<std::string>& path);
  /// Null: nobody reads it.
  const WantedFields* find(const std::string& field) const;
};

/// Decodes a whole message; the document has only the wanted fields. Array counts are checked
/// against the remaining bytes before anything is allocated. Throws MessageError (truncated,
/// trailing bytes, count beyond the message's end).
Value decode(const Schema& schema, const Bytes& bytes, const WantedFields& wanted = {});

/// The inverse of decode. Throws MessageError when the document does not have the schema's shape.
Bytes encode(const Schema& schema, const Value& document);

struct JsonOptions {
  /// Arrays longer than this become {"type":..., "count":...}: large arrays stay in the bytes.
  std::size_t longest_array = 1024;
};

/// Writes a document for people and for queries, as mongodb_store lays messages out: time and
/// duration are {"secs","nsecs"}; numbers that JSON lacks are the strings "nan", "inf", "-inf";
/// strings that are no UTF-8 have each bad byte replaced by U+FFFD; uint8[] up to the limit is an
/// array of numbers.
nlohmann::json toJson(const Value& document, const JsonOptions& options = {});

/// The value at a path ("goal.trajectory.header"); null if a name on the way is missing.
const Value* findValue(const Value& message, const std::string& path);
Value* findValue(Value& message, const std::string& path);

/// Does what findValue does, but throws MessageError if a name is missing.
Value& valueAt(Value& message, const std::string& path);

/// The elements of a float64[]; empty for every other value.
std::vector<double> numbersOf(const Value& value);
/// The elements of a field; empty if it is missing.
std::vector<double> numbersAt(const Value& message, const std::string& path);
NumberArray numberArray(const std::vector<double>& numbers);

RosDuration toRosDuration(std::int64_t ns);

}  // namespace afterglow::replay
