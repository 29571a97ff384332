#include "replay/messages/bson_document.hpp"

#include <utf8.h>

#include <cmath>
#include <limits>
#include <set>

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

namespace {

/// Appends one value under one key.
class Appender {
 public:
  Appender(bson_t& to, std::string_view key, const BsonOptions& options)
      : to_(to), key_(key.data()), length_(static_cast<int>(key.size())), options_(options) {}

  void append(const Value& value) const { std::visit(*this, asVariant(value)); }

  void operator()(BoolByte value) const {
    require(value.byte < 2 ? bson_append_bool(&to_, key_, length_, value.byte == 1)
                           : bson_append_int32(&to_, key_, length_, value.byte));
  }

  template <typename T>
  void operator()(T value) const {
    static_assert(std::is_arithmetic_v<T>);
    if constexpr (std::is_floating_point_v<T>) {
      require(bson_append_double(&to_, key_, length_, static_cast<double>(value)));
    } else {
      const auto wide = static_cast<std::int64_t>(value);  // NOLINT: an int8 is a number here
      const auto narrow = static_cast<std::int32_t>(wide);
      require(narrow == wide ? bson_append_int32(&to_, key_, length_, narrow)
                             : bson_append_int64(&to_, key_, length_, wide));
    }
  }

  void operator()(const std::string& value) const {
    const auto* data = reinterpret_cast<const std::uint8_t*>(value.data());
    if (!utf8::is_valid(value.begin(), value.end())) return binary(data, value.size());
    require(value.size() <= kLargest &&
            bson_append_utf8(&to_, key_, length_, value.data(), static_cast<int>(value.size())));
  }

  void operator()(RosTime value) const { parts(value.sec, value.nsec); }
  void operator()(RosDuration value) const { parts(value.sec, value.nsec); }

  void operator()(const NumberArray& value) const {
    if (value.size() > options_.longest_array) return summary(value);
    if (value.type == FieldType::UInt8) return binary(value.bytes.data(), value.bytes.size());
    if (value.type == FieldType::Bool) return numbers<BoolByte>(value);
    withNumber(value.type, [&](auto zero) { numbers<decltype(zero)>(value); });
  }

  void operator()(const Array& value) const {
    array([&](bson_t& elements) {
      for (std::size_t i = 0; i < value.size(); ++i) element(elements, i, value[i]);
    });
  }

  void operator()(const Object& value) const {
    bson_t child;
    require(bson_append_document_begin(&to_, key_, length_, &child));
    for (const auto& [key, field] : value) Appender(child, key, options_).append(field);
    require(bson_append_document_end(&to_, &child));
  }

 private:
  static constexpr std::size_t kLargest = std::numeric_limits<std::int32_t>::max();

  static void require(bool appended) {
    if (!appended) throw MessageError("the message is too large for a BSON document");
  }

  // std::visit of GCC 9 does not see through a class derived from a variant.
  template <typename... T>
  static const std::variant<T...>& asVariant(const std::variant<T...>& value) {
    return value;
  }

  template <typename Work>
  void array(const Work& work) const {
    bson_t elements;
    require(bson_append_array_begin(&to_, key_, length_, &elements));
    work(elements);
    require(bson_append_array_end(&to_, &elements));
  }

  /// Appends `value` (a Value or one of its kinds) as the element at `index`.
  template <typename T>
  void element(bson_t& elements, std::size_t index, const T& value) const {
    char buffer[16];
    const char* key = nullptr;
    const std::size_t size =
        bson_uint32_to_string(static_cast<std::uint32_t>(index), &key, buffer, sizeof buffer);
    const Appender appender(elements, {key, size}, options_);
    if constexpr (std::is_same_v<T, Value>) {
      appender.append(value);
    } else {
      appender(value);
    }
  }

  template <typename T>
  void numbers(const NumberArray& value) const;

  void binary(const std::uint8_t* data, std::size_t size) const {
    static const std::uint8_t kNothing = 0;
    require(size <= kLargest &&
            bson_append_binary(&to_, key_, length_, BSON_SUBTYPE_BINARY,
                               size == 0 ? &kNothing : data, static_cast<std::uint32_t>(size)));
  }

  void summary(const NumberArray& value) const {
    bson_t child;
    require(bson_append_document_begin(&to_, key_, length_, &child));
    Appender(child, "type", options_)(std::string(name(value.type)));
    Appender(child, "count", options_)(static_cast<std::uint64_t>(value.size()));
    require(bson_append_document_end(&to_, &child));
  }

  template <typename T>
  void parts(T sec, T nsec) const {
    bson_t child;
    require(bson_append_document_begin(&to_, key_, length_, &child));
    Appender(child, "secs", options_)(sec);
    Appender(child, "nsecs", options_)(nsec);
    require(bson_append_document_end(&to_, &child));
  }

  bson_t& to_;
  const char* key_;
  int length_;
  const BsonOptions& options_;
};

template <typename T>
void Appender::numbers(const NumberArray& value) const {
  array([&](bson_t& elements) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      if constexpr (std::is_same_v<T, BoolByte>) {
        element(elements, i, BoolByte{value.bytes[i]});
      } else {
        element(elements, i, loadNumber<T>(value.bytes.data() + i * sizeof(T)));
      }
    }
  });
}

// The number of fields that are added is limited: a short document must not take much memory.
constexpr std::size_t kMostMissing = 1 << 22;

/// Follows the schema, so that the depth of the BSON does not matter; iterators check its lengths.
class BsonReader {
 public:
  explicit BsonReader(const Schema& schema) : schema_(schema) {}

  BsonMessage read(const bson_t& bson) {
    bson_iter_t fields;
    if (!bson_iter_init(&fields, &bson)) fail("is damaged BSON");
    BsonMessage result;
    try {
      result.document = message(0, fields);
    } catch (const BsonMismatch& problem) {
      fail(problem.what());
    }
    result.missing.assign(missing_.begin(), missing_.end());
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    const std::string at = path();
    throw MessageError("document of " + schema_.root().name + (at.empty() ? "" : ", field " + at) +
                       ": " + what);
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
      // Writers keep the definition's order, so the search usually takes one step.
      bool is_there = find(at, field);
      if (!is_there) {
        at = first;
        is_there = find(at, field);
      }
      if (is_there) {
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
    if (field.type != FieldType::Message) return bsonScalar(field.type, at);
    if (!BSON_ITER_HOLDS_DOCUMENT(&at)) failBsonType(at, schema_.types()[field.message].name);
    return message(field.message, children(at));
  }

  bson_iter_t children(const bson_iter_t& at) const {
    bson_iter_t child;
    if (!bson_iter_recurse(&at, &child)) fail("is damaged BSON");
    return child;
  }

  Value array(const Field& field, const bson_iter_t& at) {
    if (isNumber(field.type)) return numbers(field, at);
    Array elements;
    forEach(field, at,
            [&](const bson_iter_t& element) { elements.push_back(single(field, element)); });
    checkLength(field, elements.size());
    return elements;
  }

  Value numbers(const Field& field, const bson_iter_t& at) {
    NumberArray array{field.type, {}};
    if (field.type == FieldType::UInt8 && !BSON_ITER_HOLDS_ARRAY(&at)) {
      const std::string_view data = bsonBytes(at, "binary data");
      array.bytes.assign(data.begin(), data.end());
    } else {
      forEach(field, at, [&](const bson_iter_t& element) { addBsonNumber(array, element); });
    }
    checkLength(field, array.size());
    return array;
  }

  template <typename Work>
  void forEach(const Field& field, const bson_iter_t& at, const Work& work) {
    if (!BSON_ITER_HOLDS_ARRAY(&at))
      failBsonType(at, "an array of " + std::string(name(field.type)));
    bson_iter_t element = children(at);
    while (bson_iter_next(&element)) work(element);
    if (element.err_off > 0) fail("is damaged BSON");
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
    if (isNumber(field.type))
      return NumberArray{field.type, Bytes(length * fixedSize(field.type))};
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

void appendBson(const Value& document, bson_t& bson, const BsonOptions& options) {
  const auto* fields = std::get_if<Object>(&document);
  if (!fields) throw MessageError("a BSON document needs a message, not a single value");
  for (const auto& [key, value] : *fields) Appender(bson, key, options).append(value);
}

BsonMessage messageFromBson(const Schema& schema, const bson_t& bson) {
  return BsonReader(schema).read(bson);
}

}  // namespace afterglow::replay
