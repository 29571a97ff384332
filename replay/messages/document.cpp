#include "replay/messages/document.hpp"

#include <algorithm>

#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

// Messages and arrays need not take bytes of their own, but take some hundred bytes of memory as a
// tree of values. So many are decoded for nothing, and beyond them one in so many bytes; in real
// messages one takes four bytes and more.
constexpr std::size_t kFreeTrees = 65536;
constexpr std::size_t kBytesOfTree = 2;

// An element takes far more memory than its smallest message; a count is believed step by step.
constexpr std::size_t kReserved = 1024;

bool isNumber(FieldType type) {
  return type != FieldType::String && type != FieldType::Time && type != FieldType::Duration &&
         type != FieldType::Message;
}

class Decoder {
 public:
  Decoder(const Schema& schema, const Bytes& bytes)
      : schema_(schema),
        reader_(schema, bytes),
        most_trees_(kFreeTrees + bytes.size() / kBytesOfTree) {}

  Value decode() {
    Value document = message(0);
    reader_.finish();
    return document;
  }

 private:
  Object message(std::size_t type_index) {
    countTree();
    Object object;
    const MessageType& type = schema_.types()[type_index];
    object.reserve(type.fields.size());
    for (const Field& field : type.fields) {
      reader_.enter(field);
      object.emplace_back(field.name,
                          field.arity == Field::Arity::Single ? single(field) : array(field));
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

  Value array(const Field& field) {
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
      elements.push_back(single(field));
    }
    return elements;
  }

  Value single(const Field& field) {
    switch (field.type) {
      case FieldType::Bool:
        return BoolByte{reader_.number<std::uint8_t>()};
      case FieldType::Int8:
        return reader_.number<std::int8_t>();
      case FieldType::UInt8:
        return reader_.number<std::uint8_t>();
      case FieldType::Int16:
        return reader_.number<std::int16_t>();
      case FieldType::UInt16:
        return reader_.number<std::uint16_t>();
      case FieldType::Int32:
        return reader_.number<std::int32_t>();
      case FieldType::UInt32:
        return reader_.number<std::uint32_t>();
      case FieldType::Int64:
        return reader_.number<std::int64_t>();
      case FieldType::UInt64:
        return reader_.number<std::uint64_t>();
      case FieldType::Float32:
        return reader_.number<float>();
      case FieldType::Float64:
        return reader_.number<double>();
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
        break;
    }
    return message(field.message);
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
      case FieldType::Int8:
        return number(as<std::int8_t>(value, type));
      case FieldType::UInt8:
        return number(as<std::uint8_t>(value, type));
      case FieldType::Int16:
        return number(as<std::int16_t>(value, type));
      case FieldType::UInt16:
        return number(as<std::uint16_t>(value, type));
      case FieldType::Int32:
        return number(as<std::int32_t>(value, type));
      case FieldType::UInt32:
        return number(as<std::uint32_t>(value, type));
      case FieldType::Int64:
        return number(as<std::int64_t>(value, type));
      case FieldType::UInt64:
        return number(as<std::uint64_t>(value, type));
      case FieldType::Float32:
        return number(as<float>(value, type));
      case FieldType::Float64:
        return number(as<double>(value, type));
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
    }
  }

  const Schema& schema_;
  Bytes bytes_;
  std::vector<const std::string*> path_;
};

}  // namespace

Value decode(const Schema& schema, const Bytes& bytes) { return Decoder(schema, bytes).decode(); }

Bytes encode(const Schema& schema, const Value& document) {
  return Encoder(schema).encode(document);
}

}  // namespace afterglow::replay
