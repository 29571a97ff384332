#include <utf8.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "replay/messages/document.hpp"
#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

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

json boolsToJson(const NumberArray& array) {
  json elements = json::array();
  for (const std::uint8_t byte : array.bytes) elements.push_back(byte != 0);
  return elements;
}

json numbersToJson(const NumberArray& array) {
  switch (array.type) {
    case FieldType::Bool:
      return boolsToJson(array);
    case FieldType::Int8:
      return elementsToJson<std::int8_t>(array);
    case FieldType::UInt8:
      return elementsToJson<std::uint8_t>(array);
    case FieldType::Int16:
      return elementsToJson<std::int16_t>(array);
    case FieldType::UInt16:
      return elementsToJson<std::uint16_t>(array);
    case FieldType::Int32:
      return elementsToJson<std::int32_t>(array);
    case FieldType::UInt32:
      return elementsToJson<std::uint32_t>(array);
    case FieldType::Int64:
      return elementsToJson<std::int64_t>(array);
    case FieldType::UInt64:
      return elementsToJson<std::uint64_t>(array);
    case FieldType::Float32:
      return elementsToJson<float>(array);
    case FieldType::Float64:
      return elementsToJson<double>(array);
    default:
      throw MessageError("an array of " + std::string(name(array.type)) + " holds no numbers");
  }
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

json toJson(const Value& document, const JsonOptions& options) {
  return ToJson(options).convert(document);
}

}  // namespace afterglow::replay
