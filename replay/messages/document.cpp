#include "replay/messages/document.hpp"

#include <utf8.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

// Messages and arrays may take no bytes, but take some hundred bytes of memory as a tree of values.
// The first constant limits how many are decoded without bytes; beyond it, each has to be paid for
// with the bytes of the second constant. In real messages each takes four bytes or more.
constexpr std::size_t kFreeTrees = 65536;
constexpr std::size_t kBytesOfTree = 2;

// An element takes far more memory than its bytes; memory for a count is reserved step by step.
constexpr std::size_t kReserved = 1024;

class Decoder {
 public:
  Decoder(const Schema& schema, const Bytes& bytes)
      : schema_(schema),
        reader_(schema, bytes),
        most_trees_(kFreeTrees + bytes.size() / kBytesOfTree) {}

  Value decode(const WantedFields& wanted) {
    Value document = message(0, wanted);
    reader_.finish();
    return document;
  }

 private:
  Object message(std::size_t type_index, const WantedFields& wanted) {
    countTree();
    Object object;
    const MessageType& type = schema_.types()[type_index];
    object.reserve(wanted.below.empty() ? type.fields.size() : wanted.below.size());
    for (const Field& field : type.fields) {
      const WantedFields* const part = wanted.find(field.name);
      if (!part) {
        reader_.skipField(field);
        continue;
      }
      reader_.enter(field);
      object.emplace_back(field.name, field.arity == Field::Arity::Single ? single(field, *part)
                                                                          : array(field, *part));
      reader_.leave();
    }
    return object;
  }

  void countTree() {
    if (++trees_ > most_trees_) {
      reader_.fail("more than " + std::to_string(most_trees_) +
                   " messages and arrays; so few bytes do not hold as many");
    }
  }

  Value array(const Field& field, const WantedFields& wanted) {
    countTree();
    const std::size_t count = reader_.count(field);
    if (isNumber(field.type)) {
      const std::size_t size = count * fixedSize(field.type);
      const std::uint8_t* from = reader_.take(size);
      return NumberArray{field.type, Bytes(from, from + size)};
    }
    Array elements;
    elements.reserve(std::min(count, kReserved));
    for (std::size_t i = 0; i < count; ++i) {
      reader_.atElement(i);
      elements.push_back(single(field, wanted));
    }
    return elements;
  }

  Value single(const Field& field, const WantedFields& wanted) {
    switch (field.type) {
      case FieldType::Bool:
        return BoolByte{reader_.number<std::uint8_t>()};
      case FieldType::String:
        return reader_.string();
      case FieldType::Time: {
        const auto sec = reader_.number<std::uint32_t>();
        return RosTime{sec, reader_.number<std::uint32_t>()};
      }
      case FieldType::Duration: {
        const auto sec = reader_.number<std::int32_t>();
        return RosDuration{sec, reader_.number<std::int32_t>()};
      }
      case FieldType::Message:
        return message(field.message, wanted);
      default:
        return withNumber(field.type, [&](auto zero) -> Value {
          return reader_.number<decltype(zero)>();
        });
    }
  }

  const Schema& schema_;
  WireReader reader_;
  const std::size_t most_trees_;
  std::size_t trees_ = 0;
};

class Encoder {
 public:
  explicit Encoder(const Schema& schema) : schema_(schema) {}

  Bytes encode(const Value& document) {
    message(0, document);
    return std::move(bytes_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    std::string path;
    for (const std::string* part : path_) path += (path.empty() ? "" : ".") + *part;
    throw MessageError("document of " + schema_.root().name +
                       (path.empty() ? "" : ", field " + path) + ": " + what);
  }

  template <typename T>
  const T& as(const Value& value, std::string_view expected) const {
    if (const T* held = std::get_if<T>(&value)) return *held;
    fail("is not of type " + std::string(expected));
  }

  template <typename T>
  void number(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    storeNumber(bytes_.data() + at, value);
  }

  void size(std::size_t value) {
    if (value > 0xFFFFFFFFu) fail("is longer than a message can say");
    number(static_cast<std::uint32_t>(value));
  }

  void message(std::size_t type_index, const Value& value) {
    const MessageType& type = schema_.types()[type_index];
    const auto& object = as<Object>(value, type.name);
    if (object.size() != type.fields.size()) {
      fail("has " + std::to_string(object.size()) + " fields; " + type.name + " has " +
           std::to_string(type.fields.size()));
    }
    for (std::size_t i = 0; i < object.size(); ++i) {
      const Field& field = type.fields[i];
      path_.push_back(&field.name);
      if (object[i].first != field.name) fail("stands where \"" + object[i].first + "\" is found");
      if (field.arity == Field::Arity::Single) {
        single(field, object[i].second);
      } else {
        array(field, object[i].second);
      }
      path_.pop_back();
    }
  }

  void count(const Field& field, std::size_t value) {
    if (field.arity == Field::Arity::DynamicArray) {
      size(value);
    } else if (value != field.length) {
      fail("has " + std::to_string(value) + " elements instead of " + std::to_string(field.length));
    }
  }

  void array(const Field& field, const Value& value) {
    const std::string type = std::string(name(field.type)) + "[]";
    if (isNumber(field.type)) {
      const auto& numbers = as<NumberArray>(value, type);
      if (numbers.type != field.type) fail("is not of type " + type);
      if (numbers.bytes.size() % fixedSize(field.type) != 0) fail("ends within an element");
      count(field, numbers.size());
      bytes_.insert(bytes_.end(), numbers.bytes.begin(), numbers.bytes.end());
      return;
    }
    const auto& elements = as<Array>(value, type);
    count(field, elements.size());
    for (const Value& element : elements) single(field, element);
  }

  void single(const Field& field, const Value& value) {
    const std::string_view type = name(field.type);
    switch (field.type) {
      case FieldType::Bool:
        return number(as<BoolByte>(value, type).byte);
      case FieldType::String: {
        const auto& text = as<std::string>(value, type);
        size(text.size());
        bytes_.insert(bytes_.end(), text.begin(), text.end());
        return;
      }
      case FieldType::Time: {
        const auto& time = as<RosTime>(value, type);
        number(time.sec);
        return number(time.nsec);
      }
      case FieldType::Duration: {
        const auto& duration = as<RosDuration>(value, type);
        number(duration.sec);
        return number(duration.nsec);
      }
      case FieldType::Message:
        return message(field.message, value);
      default:
        withNumber(field.type, [&](auto zero) { number(as<decltype(zero)>(value, type)); });
    }
  }

  const Schema& schema_;
  Bytes bytes_;
  std::vector<const std::string*> path_;
};

using nlohmann::json;

std::string repairUtf8(std::string_view text) {
  std::string repaired;
  repaired.reserve(text.size());
  for (auto at = text.begin(); at != text.end();) {
    const auto bad = utf8::find_invalid(at, text.end());
    repaired.append(at, bad);
    if (bad == text.end()) break;
    repaired += "\xEF\xBF\xBD";
    at = bad + 1;
  }
  return repaired;
}

template <typename T>
json numberToJson(T value) {
  if constexpr (std::is_floating_point_v<T>) {
    if (std::isnan(value)) return "nan";
    if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  }
  return value;
}

template <typename T>
json elementsToJson(const NumberArray& array) {
  json elements = json::array();
  for (std::size_t i = 0; i < array.size(); ++i) {
    elements.push_back(numberToJson(loadNumber<T>(array.bytes.data() + i * sizeof(T))));
  }
  return elements;
}

json numbersToJson(const NumberArray& array) {
  if (array.type != FieldType::Bool) {
    return withNumber(array.type,
                      [&](auto zero) { return elementsToJson<decltype(zero)>(array); });
  }
  json elements = json::array();
  for (const std::uint8_t byte : array.bytes) elements.push_back(byte != 0);
  return elements;
}

class ToJson {
 public:
  explicit ToJson(const JsonOptions& options) : options_(options) {}

  json operator()(BoolByte value) const { return value.byte != 0; }
  json operator()(const std::string& value) const { return repairUtf8(value); }
  json operator()(RosTime value) const { return {{"secs", value.sec}, {"nsecs", value.nsec}}; }
  json operator()(RosDuration value) const { return {{"secs", value.sec}, {"nsecs", value.nsec}}; }

  json operator()(const NumberArray& value) const {
    if (fixedSize(value.type) > 0 && value.size() > options_.longest_array) {
      return {{"type", name(value.type)}, {"count", value.size()}};
    }
    return numbersToJson(value);
  }

  json operator()(const Array& value) const {
    if (value.size() > options_.longest_array) {
      return {{"type", name(elementType(value.front()))}, {"count", value.size()}};
    }
    json elements = json::array();
    for (const Value& element : value) elements.push_back(convert(element));
    return elements;
  }

  json operator()(const Object& value) const {
    json object = json::object();
    for (const auto& [key, field] : value) object[key] = convert(field);
    return object;
  }

  template <typename T>
  json operator()(T value) const {
    static_assert(std::is_arithmetic_v<T>);
    return numberToJson(value);
  }

  json convert(const Value& value) const { return std::visit(*this, asVariant(value)); }

 private:
  static FieldType elementType(const Value& value) {
    if (std::holds_alternative<std::string>(value)) return FieldType::String;
    if (std::holds_alternative<RosTime>(value)) return FieldType::Time;
    if (std::holds_alternative<RosDuration>(value)) return FieldType::Duration;
    return FieldType::Message;
  }

  // std::visit of GCC 9 does not see through a class derived from a variant.
  template <typename... T>
  static const std::variant<T...>& asVariant(const std::variant<T...>& value) {
    return value;
  }

  const JsonOptions& options_;
};

}  // namespace

void WantedFields::add(const std::vector<std::string>& path) {
  WantedFields* at = this;
  bool is_new = true;
  for (const std::string& field : path) {
    const auto known = std::find_if(at->below.begin(), at->below.end(),
                                    [&](const WantedFields& part) { return part.name == field; });
    if (known == at->below.end()) {
      if (!is_new && at->below.empty()) return;  // all of it is read already
      at->below.push_back({field, {}});
      at = &at->below.back();
      is_new = true;
    } else {
      at = &*known;
      is_new = false;
    }
  }
  at->below.clear();
}

const WantedFields* WantedFields::find(const std::string& field) const {
  if (below.empty()) return this;
  const auto found = std::find_if(below.begin(), below.end(),
                                  [&](const WantedFields& part) { return part.name == field; });
  return found == below.end() ? nullptr : &*found;
}

Value decode(const Schema& schema, const Bytes& bytes, const WantedFields& wanted) {
  return Decoder(schema, bytes).decode(wanted);
}

Bytes encode(const Schema& schema, const Value& document) {
  return Encoder(schema).encode(document);
}

const Value* findValue(const Value& message, const std::string& path) {
  const auto* object = std::get_if<Object>(&message);
  if (!object) {
    return nullptr;
  }
  const std::size_t dot = path.find('.');
  for (const auto& [name, value] : *object) {
    if (path.compare(0, dot, name) == 0) {
      return dot == std::string::npos ? &value : findValue(value, path.substr(dot + 1));
    }
  }
  return nullptr;
}

Value* findValue(Value& message, const std::string& path) {
  return const_cast<Value*>(findValue(static_cast<const Value&>(message), path));
}

Value& valueAt(Value& message, const std::string& path) {
  if (Value* found = findValue(message, path)) return *found;
  throw MessageError("no field " + path);
}

std::vector<double> numbersOf(const Value& value) {
  const auto* array = std::get_if<NumberArray>(&value);
  std::vector<double> numbers;
  if (array && array->type == FieldType::Float64) {
    numbers.resize(array->size());
    if (!numbers.empty()) std::memcpy(numbers.data(), array->bytes.data(), array->bytes.size());
  }
  return numbers;
}

std::vector<double> numbersAt(const Value& message, const std::string& path) {
  const Value* value = findValue(message, path);
  return value ? numbersOf(*value) : std::vector<double>();
}

NumberArray numberArray(const std::vector<double>& numbers) {
  NumberArray array{FieldType::Float64, Bytes(numbers.size() * sizeof(double))};
  if (!numbers.empty()) std::memcpy(array.bytes.data(), numbers.data(), array.bytes.size());
  return array;
}

RosDuration toRosDuration(std::int64_t ns) {
  return {static_cast<std::int32_t>(ns / 1'000'000'000),
          static_cast<std::int32_t>(ns % 1'000'000'000)};
}

json toJson(const Value& document, const JsonOptions& options) {
  return ToJson(options).convert(document);
}

}  // namespace afterglow::replay
