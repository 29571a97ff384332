/// \file
/// Message types and messages that nobody would think of, the same for the same seed.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::test {

class RandomMessages {
 public:
  explicit RandomMessages(unsigned seed) : random_(seed) {}

  /// A definition of fuzz/Root with up to four contained types.
  std::string definition() {
    const std::size_t contained = below(5);
    std::string text = fields(contained);
    for (std::size_t i = contained; i-- > 0;) {
      text += "\n" + std::string(80, '=') + "\nMSG: fuzz/T" + std::to_string(i) + "\n" + fields(i);
    }
    return text;
  }

  /// Any bits, but for signaling NaNs, which conversions may quieten.
  replay::Bytes message(const replay::Schema& schema) {
    return replay::encode(schema, object(schema, 0));
  }

 private:
  std::size_t below(std::size_t end) { return random_() % end; }

  /// Of a type that may contain T0 to T(types - 1).
  std::string fields(std::size_t types) {
    static const std::vector<std::string> kBuiltins = {
        "bool",   "int8",    "uint8",   "int16",  "uint16", "int32",    "uint32", "int64",
        "uint64", "float32", "float64", "string", "time",   "duration", "byte",   "char"};
    static const std::vector<std::string> kArities = {"", "", "[]", "[3]", "[0]"};
    std::string text;
    const std::size_t count = below(8);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t type = below(kBuiltins.size() + 2 * types);
      text += type < kBuiltins.size() ? kBuiltins[type] : "T" + std::to_string(type % types);
      text += kArities[below(kArities.size())] + " f" + std::to_string(i) + "\n";
    }
    return text;
  }

  replay::Value object(const replay::Schema& schema, std::size_t type) {
    replay::Object object;
    for (const replay::Field& field : schema.types()[type].fields) {
      object.emplace_back(field.name, value(schema, field));
    }
    return object;
  }

  replay::Value value(const replay::Schema& schema, const replay::Field& field) {
    using Arity = replay::Field::Arity;
    if (field.arity == Arity::Single) return single(schema, field);
    const std::size_t count = field.arity == Arity::FixedArray ? field.length : below(5);
    const std::size_t size = replay::fixedSize(field.type);
    const bool is_number = size > 0 && field.type != replay::FieldType::Time &&
                           field.type != replay::FieldType::Duration;
    replay::NumberArray numbers{field.type, {}};
    replay::Array elements;
    for (std::size_t i = 0; i < count; ++i) {
      if (is_number) {
        const replay::Bytes bytes = numberBytes(field.type);
        numbers.bytes.insert(numbers.bytes.end(), bytes.begin(), bytes.end());
      } else {
        elements.push_back(single(schema, field));
      }
    }
    if (is_number) return numbers;
    return elements;
  }

  replay::Value single(const replay::Schema& schema, const replay::Field& field) {
    if (field.type == replay::FieldType::Message) return object(schema, field.message);
    replay::Bytes bytes;
    if (field.type == replay::FieldType::String) {
      const std::size_t size = below(12);
      bytes = {static_cast<std::uint8_t>(size), 0, 0, 0};
      const bool is_ascii = below(2) == 0;
      for (std::size_t i = 0; i < size; ++i) {
        bytes.push_back(static_cast<std::uint8_t>(is_ascii ? 'a' + below(26) : below(256)));
      }
    } else {
      bytes = numberBytes(field.type);
    }
    // The decoder knows which kind of value the bytes are.
    static const auto kSchemas = [] {
      std::vector<replay::Schema> schemas;
      for (int type = 0; type < static_cast<int>(replay::FieldType::Message); ++type) {
        const auto name = replay::name(static_cast<replay::FieldType>(type));
        schemas.push_back(replay::Schema::parse("fuzz/One", std::string(name) + " x\n"));
      }
      return schemas;
    }();
    const auto one = replay::decode(kSchemas[static_cast<std::size_t>(field.type)], bytes);
    return std::get<replay::Object>(one).front().second;
  }

  replay::Bytes numberBytes(replay::FieldType type) {
    replay::Bytes bytes(replay::fixedSize(type));
    const std::size_t kind = below(4);  // zeros, ones, special floats, any
    for (std::uint8_t& byte : bytes) {
      byte = kind == 0 ? 0 : kind == 1 ? 0xFF : static_cast<std::uint8_t>(below(256));
    }
    const std::size_t last = bytes.size() - 1;
    if (type == replay::FieldType::Bool && kind != 3) bytes[0] &= 1;
    const bool is_float = type == replay::FieldType::Float32 || type == replay::FieldType::Float64;
    if (!is_float) return bytes;
    if (kind == 2) bytes[last] |= 0x7F;
    const std::uint8_t exponent = type == replay::FieldType::Float32 ? 0x80 : 0xF0;
    if ((bytes[last] & 0x7F) == 0x7F && (bytes[last - 1] & exponent) == exponent) {
      bytes[last - 1] |= exponent == 0x80 ? 0x40 : 0x08;  // a quiet NaN
    }
    return bytes;
  }

  std::mt19937 random_;
};

}  // namespace afterglow::test
