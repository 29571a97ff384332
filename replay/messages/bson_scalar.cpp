#include "replay/messages/bson_scalar.hpp"

#include <cmath>
#include <limits>

#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

std::string typeName(bson_type_t type) {
  switch (type) {
    case BSON_TYPE_DOUBLE:
      return "a double";
    case BSON_TYPE_UTF8:
      return "a string";
    case BSON_TYPE_DOCUMENT:
      return "a document";
    case BSON_TYPE_ARRAY:
      return "an array";
    case BSON_TYPE_BINARY:
      return "binary data";
    case BSON_TYPE_BOOL:
      return "a bool";
    case BSON_TYPE_DATE_TIME:
      return "a date";
    case BSON_TYPE_INT32:
    case BSON_TYPE_INT64:
      return "an integer";
    default:
      return "BSON of type " + std::to_string(type);
  }
}

[[noreturn]] void fail(const std::string& what) { throw BsonMismatch(what); }

template <typename T>
T integer(const bson_iter_t& at) {
  std::int64_t wide = 0;
  if (BSON_ITER_HOLDS_DOUBLE(&at)) {
    const double value = bson_iter_double(&at);
    constexpr double kEnd = 9223372036854775808.0;
    if (!(value >= -kEnd && value < kEnd && value == std::trunc(value))) {
      fail("the number " + std::to_string(value) + " is no integer");
    }
    wide = static_cast<std::int64_t>(value);
  } else if (BSON_ITER_HOLDS_INT(&at) || BSON_ITER_HOLDS_BOOL(&at)) {
    wide = bson_iter_as_int64(&at);
  } else {
    failBsonType(at, "an integer");
  }
  const auto value = static_cast<T>(wide);
  if (static_cast<std::int64_t>(value) == wide) return value;
  // The C++ loggers wrote uint32 as int32.
  if (std::is_same_v<T, std::uint32_t> && BSON_ITER_HOLDS_INT32(&at)) return value;
  fail("does not hold " + std::to_string(wide));
}

double real(const bson_iter_t& at) {
  if (BSON_ITER_HOLDS_DOUBLE(&at)) return bson_iter_double(&at);
  if (BSON_ITER_HOLDS_UTF8(&at)) {
    // As in JSON, for servers that take no such numbers.
    const std::string_view word = bsonBytes(at, "a number");
    if (word == "nan") return std::numeric_limits<double>::quiet_NaN();
    if (word == "inf") return std::numeric_limits<double>::infinity();
    if (word == "-inf") return -std::numeric_limits<double>::infinity();
  }
  if (!BSON_ITER_HOLDS_INT(&at)) failBsonType(at, "a number");
  return static_cast<double>(bson_iter_as_int64(&at));
}

template <typename T>
T numberOf(const bson_iter_t& at) {
  if constexpr (std::is_floating_point_v<T>) {
    return static_cast<T>(real(at));
  } else {
    return integer<T>(at);
  }
}

template <typename T>
T part(const bson_iter_t& at, const char* key) {
  if (!BSON_ITER_HOLDS_DOCUMENT(&at)) failBsonType(at, "{secs, nsecs}");
  bson_iter_t child;
  if (!bson_iter_recurse(&at, &child)) fail("is damaged BSON");
  if (!bson_iter_find(&child, key)) fail(std::string("has no ") + key);
  return integer<T>(child);
}

RosTime time(const bson_iter_t& at) {
  if (!BSON_ITER_HOLDS_DATE_TIME(&at)) {
    return {part<std::uint32_t>(at, "secs"), part<std::uint32_t>(at, "nsecs")};
  }
  const std::int64_t ms = bson_iter_date_time(&at);
  if (ms < 0 || ms / 1000 > std::numeric_limits<std::uint32_t>::max()) {
    fail("the date " + std::to_string(ms) + " ms is no ROS time");
  }
  return {static_cast<std::uint32_t>(ms / 1000), static_cast<std::uint32_t>(ms % 1000 * 1000000)};
}

template <typename T>
void addNumber(NumberArray& array, T number) {
  const std::size_t at = array.bytes.size();
  array.bytes.resize(at + sizeof number);
  storeNumber(array.bytes.data() + at, number);
}

}  // namespace

void failBsonType(const bson_iter_t& at, std::string_view expected) {
  fail("is " + typeName(bson_iter_type(&at)) + " instead of " + std::string(expected));
}

std::string_view bsonBytes(const bson_iter_t& at, std::string_view expected) {
  std::uint32_t size = 0;
  if (BSON_ITER_HOLDS_UTF8(&at)) {
    const char* text = bson_iter_utf8(&at, &size);
    return {text, size};
  }
  if (!BSON_ITER_HOLDS_BINARY(&at)) failBsonType(at, expected);
  const std::uint8_t* data = nullptr;
  bson_subtype_t subtype = BSON_SUBTYPE_BINARY;
  bson_iter_binary(&at, &subtype, &size, &data);
  return {reinterpret_cast<const char*>(data), size};
}

Value bsonScalar(FieldType type, const bson_iter_t& at) {
  switch (type) {
    case FieldType::Bool:
      return BoolByte{integer<std::uint8_t>(at)};
    case FieldType::String: {
      const std::string_view text = bsonBytes(at, "a string");
      return std::string(text);
    }
    case FieldType::Time:
      return time(at);
    case FieldType::Duration:
      return RosDuration{part<std::int32_t>(at, "secs"), part<std::int32_t>(at, "nsecs")};
    case FieldType::Message:
      throw std::logic_error("a message is no scalar");
    default:
      return withNumber(type, [&](auto zero) -> Value { return numberOf<decltype(zero)>(at); });
  }
}

void addBsonNumber(NumberArray& array, const bson_iter_t& at) {
  const FieldType type = array.type == FieldType::Bool ? FieldType::UInt8 : array.type;
  withNumber(type, [&](auto zero) { addNumber(array, numberOf<decltype(zero)>(at)); });
}

Value zeroScalar(FieldType type) {
  switch (type) {
    case FieldType::Bool:
      return BoolByte{};
    case FieldType::String:
    case FieldType::Message:
      return std::string();
    case FieldType::Time:
      return RosTime{};
    case FieldType::Duration:
      return RosDuration{};
    default:
      return withNumber(type, [](auto zero) { return Value(zero); });
  }
}

}  // namespace afterglow::replay
