#include "replay/motion/odd_number.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace afterglow::replay {
namespace {

std::string oddIn(double number, const std::string& path) {
  return std::isfinite(number) ? "" : fmt::format("{} is {}", path, number);
}

template <typename Number>
std::string oddOf(const Bytes& numbers, const std::string& path) {
  for (std::size_t i = 0; i * sizeof(Number) < numbers.size(); ++i) {
    Number number;
    std::memcpy(&number, numbers.data() + i * sizeof(Number), sizeof(Number));
    if (!std::isfinite(number)) return oddIn(number, fmt::format("{}[{}]", path, i));
  }
  return "";
}

std::string oddBelow(const Value& value, const std::string& path) {
  if (const auto* number = std::get_if<double>(&value)) return oddIn(*number, path);
  if (const auto* number = std::get_if<float>(&value)) return oddIn(*number, path);
  if (const auto* numbers = std::get_if<NumberArray>(&value)) {
    return numbers->type == FieldType::Float64   ? oddOf<double>(numbers->bytes, path)
           : numbers->type == FieldType::Float32 ? oddOf<float>(numbers->bytes, path)
                                                 : "";
  }
  if (const auto* array = std::get_if<Array>(&value)) {
    for (std::size_t i = 0; i < array->size(); ++i) {
      std::string odd = oddBelow((*array)[i], fmt::format("{}[{}]", path, i));
      if (!odd.empty()) return odd;
    }
  }
  if (const auto* object = std::get_if<Object>(&value)) {
    for (const auto& [name, field] : *object) {
      std::string odd = oddBelow(field, path.empty() ? name : path + "." + name);
      if (!odd.empty()) return odd;
    }
  }
  return "";
}

}  // namespace

std::string oddNumber(const Value& document) { return oddBelow(document, ""); }

std::string oddNumber(const Schema& schema, const Bytes& bytes) {
  return oddNumber(decode(schema, bytes));
}

}  // namespace afterglow::replay
