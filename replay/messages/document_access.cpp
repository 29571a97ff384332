#include "replay/messages/document_access.hpp"

#include <cstring>

namespace afterglow::replay {

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

}  // namespace afterglow::replay
