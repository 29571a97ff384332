#include <cmath>
#include <set>

#include "replay/messages/bson_document.hpp"
#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

// What is missing is made, so it is limited: a short document must not ask for much memory.
constexpr std::size_t kMostMissing = 1 << 22;

bool isNumeric(FieldType type) {
  return fixedSize(type) > 0 && type != FieldType::Time && type != FieldType::Duration;
}

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

Value zeroScalar(FieldType type) {
  switch (type) {
    case FieldType::Bool:
      return BoolByte{};
    case FieldType::Int8:
      return std::int8_t{};
    case FieldType::UInt8:
      return std::uint8_t{};
    case FieldType::Int16:
      return std::int16_t{};
    case FieldType::UInt16:
      return std::uint16_t{};
    case FieldType::Int32:
      return std::int32_t{};
    case FieldType::UInt32:
      return std::uint32_t{};
    case FieldType::Int64:
      return std::int64_t{};
    case FieldType::UInt64:
      return std::uint64_t{};
    case FieldType::Float32:
      return float{};
    case FieldType::Float64:
      return double{};
    case FieldType::String:
    case FieldType::Message:
      return std::string();
    case FieldType::Time:
      return RosTime{};
    case FieldType::Duration:
      return RosDuration{};
  }
  return {};
}

/// Follows the schema, so that the depth of the BSON does not matter; iterators check its lengths.
class BsonReader {
 public:
  explicit BsonReader(const Schema& schema) : schema_(schema) {}

  BsonMessage read(const bson_t& bson) {
    bson_iter_t fields;
    if (!bson_iter_init(&fields, &bson)) fail("is damaged BSON");
    BsonMessage result;
    result.document = message(0, fields);
    result.missing.assign(missing_.begin(), missing_.end());
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    const std::string at = path();
    throw MessageError("document of " + schema_.root().name + (at.empty() ? "" : ", field " + at) +
                       ": " + what);
  }
  [[noreturn]] void failType(const bson_iter_t& at, std::string_view expected) const {
    fail("is " + typeName(bson_iter_type(&at)) + " instead of " + std::string(expected));
  }

  std::string path() const {
    std::string text;
    for (const Field* field : path_) {
      text += (text.empty() ? "" : ".") + field->name;
      const bool is_last = field == path_.back();
      if (field->arity != Field::Arity::Single && !is_last) text += "[]";
    }
    return text;
  }

  Object message(std::size_t type_index, const bson_iter_t& first) {
    const MessageType& type = schema_.types()[type_index];
    Object object;
    object.reserve(type.fields.size());
    bson_iter_t at = first;
    for (const Field& field : type.fields) {
      path_.push_back(&field);
      // Writers keep the definition's order, so the search is a step, most often.
      if (find(at, field) || find(at = first, field)) {
        object.emplace_back(
            field.name, field.arity == Field::Arity::Single ? single(field, at) : array(field, at));
      } else {
        missing_.insert(path());
        object.emplace_back(field.name, zero(field));
        at = first;
      }
      path_.pop_back();
    }
    return object;
  }

  /// Moves to the field, which is there and not null.
  bool find(bson_iter_t& at, const Field& field) const {
    bson_iter_t from = at;
    if (!bson_iter_find(&from, field.name.c_str())) {
      if (from.err_off > 0) fail("is damaged BSON at byte " + std::to_string(from.err_off));
      return false;
    }
    at = from;
    return bson_iter_type(&at) != BSON_TYPE_NULL;
  }

  Value single(const Field& field, const bson_iter_t& at) {
    switch (field.type) {
      case FieldType::Bool:
        return BoolByte{integer<std::uint8_t>(at)};
      case FieldType::Int8:
        return integer<std::int8_t>(at);
      case FieldType::UInt8:
        return integer<std::uint8_t>(at);
      case FieldType::Int16:
        return integer<std::int16_t>(at);
      case FieldType::UInt16:
        return integer<std::uint16_t>(at);
      case FieldType::Int32:
        return integer<std::int32_t>(at);
      case FieldType::UInt32:
        return integer<std::uint32_t>(at);
      case FieldType::Int64:
        return integer<std::int64_t>(at);
      case FieldType::UInt64:
        return integer<std::uint64_t>(at);
      case FieldType::Float32:
        return static_cast<float>(real(at));
      case FieldType::Float64:
        return real(at);
      case FieldType::String: {
        const std::string_view text = bytes(at, "a string");
        return std::string(text);
      }
      case FieldType::Time:
        return time(at);
      case FieldType::Duration:
        return RosDuration{part<std::int32_t>(at, "secs"), part<std::int32_t>(at, "nsecs")};
      case FieldType::Message:
        break;
    }
    if (!BSON_ITER_HOLDS_DOCUMENT(&at)) failType(at, schema_.types()[field.message].name);
    return message(field.message, children(at));
  }

  bson_iter_t children(const bson_iter_t& at) const {
    bson_iter_t child;
    if (!bson_iter_recurse(&at, &child)) fail("is damaged BSON");
    return child;
  }

  template <typename T>
  T integer(const bson_iter_t& at) const {
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
      failType(at, "an integer");
    }
    const auto value = static_cast<T>(wide);
    if (static_cast<std::int64_t>(value) == wide) return value;
    // The C++ loggers wrote uint32 as int32.
    if (std::is_same_v<T, std::uint32_t> && BSON_ITER_HOLDS_INT32(&at)) return value;
    fail("does not hold " + std::to_string(wide));
  }

  double real(const bson_iter_t& at) const {
    if (BSON_ITER_HOLDS_DOUBLE(&at)) return bson_iter_double(&at);
    if (BSON_ITER_HOLDS_UTF8(&at)) {
      // For servers that take no others: as in JSON.
      const std::string_view word = bytes(at, "a number");
      if (word == "nan") return std::numeric_limits<double>::quiet_NaN();
      if (word == "inf") return std::numeric_limits<double>::infinity();
      if (word == "-inf") return -std::numeric_limits<double>::infinity();
    }
    if (!BSON_ITER_HOLDS_INT(&at)) failType(at, "a number");
    return static_cast<double>(bson_iter_as_int64(&at));
  }

  /// Of a string or of binary data, which writers took for one another.
  std::string_view bytes(const bson_iter_t& at, std::string_view expected) const {
    std::uint32_t size = 0;
    if (BSON_ITER_HOLDS_UTF8(&at)) {
      const char* text = bson_iter_utf8(&at, &size);
      return {text, size};
    }
    if (!BSON_ITER_HOLDS_BINARY(&at)) failType(at, expected);
    const std::uint8_t* data = nullptr;
    bson_subtype_t subtype = BSON_SUBTYPE_BINARY;
    bson_iter_binary(&at, &subtype, &size, &data);
    return {reinterpret_cast<const char*>(data), size};
  }

  RosTime time(const bson_iter_t& at) const {
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
  T part(const bson_iter_t& at, const char* key) const {
    if (!BSON_ITER_HOLDS_DOCUMENT(&at)) failType(at, "{secs, nsecs}");
    bson_iter_t child = children(at);
    if (!bson_iter_find(&child, key)) fail(std::string("has no ") + key);
    return integer<T>(child);
  }

  Value array(const Field& field, const bson_iter_t& at) {
    if (isNumeric(field.type)) return numbers(field, at);
    Array elements;
    forEach(field, at,
            [&](const bson_iter_t& element) { elements.push_back(single(field, element)); });
    checkLength(field, elements.size());
    return elements;
  }

  Value numbers(const Field& field, const bson_iter_t& at) {
    NumberArray array{field.type, {}};
    if (field.type == FieldType::UInt8 && !BSON_ITER_HOLDS_ARRAY(&at)) {
      const std::string_view data = bytes(at, "binary data");
      array.bytes.assign(data.begin(), data.end());
    } else {
      forEach(field, at, [&](const bson_iter_t& element) { addElement(array, element); });
    }
    checkLength(field, array.size());
    return array;
  }

  template <typename Work>
  void forEach(const Field& field, const bson_iter_t& at, const Work& work) {
    if (!BSON_ITER_HOLDS_ARRAY(&at)) failType(at, "an array of " + std::string(name(field.type)));
    bson_iter_t element = children(at);
    while (bson_iter_next(&element)) work(element);
    if (element.err_off > 0) fail("is damaged BSON");
  }

  template <typename T>
  static void addNumber(NumberArray& array, T number) {
    const std::size_t at = array.bytes.size();
    array.bytes.resize(at + sizeof number);
    storeNumber(array.bytes.data() + at, number);
  }

  void addElement(NumberArray& array, const bson_iter_t& at) const {
    switch (array.type) {
      case FieldType::Bool:
      case FieldType::UInt8:
        return addNumber(array, integer<std::uint8_t>(at));
      case FieldType::Int8:
        return addNumber(array, integer<std::int8_t>(at));
      case FieldType::Int16:
        return addNumber(array, integer<std::int16_t>(at));
      case FieldType::UInt16:
        return addNumber(array, integer<std::uint16_t>(at));
      case FieldType::Int32:
        return addNumber(array, integer<std::int32_t>(at));
      case FieldType::UInt32:
        return addNumber(array, integer<std::uint32_t>(at));
      case FieldType::Int64:
        return addNumber(array, integer<std::int64_t>(at));
      case FieldType::UInt64:
        return addNumber(array, integer<std::uint64_t>(at));
      case FieldType::Float32:
        return addNumber(array, static_cast<float>(real(at)));
      default:
        return addNumber(array, real(at));
    }
  }

  void checkLength(const Field& field, std::size_t size) const {
    if (field.arity == Field::Arity::FixedArray && size != field.length) {
      fail("has " + std::to_string(size) + " elements instead of " + std::to_string(field.length));
    }
  }

  // ------------------------------------------------------------------------------ what is missing
  void countMissing(std::size_t more) {
    if (more > kMostMissing - made_) fail("too much of the message is missing");
    made_ += more;
  }

  Value zero(const Field& field) {
    if (field.arity == Field::Arity::Single) return zeroElement(field);
    const std::size_t length = field.arity == Field::Arity::FixedArray ? field.length : 0;
    countMissing(length);
    if (isNumeric(field.type)) return NumberArray{field.type, Bytes(length * fixedSize(field.type))};
    Array elements;
    for (std::size_t i = 0; i < length; ++i) elements.push_back(zeroElement(field));
    return elements;
  }

  Value zeroElement(const Field& field) {
    countMissing(1);
    if (field.type != FieldType::Message) return zeroScalar(field.type);
    Object object;
    for (const Field& inner : schema_.types()[field.message].fields) {
      object.emplace_back(inner.name, zero(inner));
    }
    return object;
  }

  const Schema& schema_;
  std::vector<const Field*> path_;
  std::set<std::string> missing_;
  std::size_t made_ = 0;
};

}  // namespace

BsonMessage messageFromBson(const Schema& schema, const bson_t& bson) {
  return BsonReader(schema).read(bson);
}

}  // namespace afterglow::replay
