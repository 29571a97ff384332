#include "replay/ros2/type_description.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <string_view>
#include <variant>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"
#include "replay/ros2/cdr_conversion.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kRequestFields =
    "string type_name\nstring type_hash\nbool include_type_sources\n";
constexpr const char* kReplyFields =
    "bool successful\nstring failure_reason\nTypeDescription type_description\n"
    "TypeSource[] type_sources\nKeyValue[] extra_information\n"
    "====\nMSG: type_description_interfaces/TypeDescription\n"
    "IndividualTypeDescription type_description\n"
    "IndividualTypeDescription[] referenced_type_descriptions\n"
    "====\nMSG: type_description_interfaces/IndividualTypeDescription\n"
    "string type_name\nField[] fields\n"
    "====\nMSG: type_description_interfaces/Field\n"
    "string name\nFieldType type\nstring default_value\n"
    "====\nMSG: type_description_interfaces/FieldType\n"
    "uint8 type_id\nuint64 capacity\nuint64 string_capacity\nstring nested_type_name\n"
    "====\nMSG: type_description_interfaces/TypeSource\n"
    "string type_name\nstring encoding\nstring raw_file_contents\n"
    "====\nMSG: type_description_interfaces/KeyValue\nstring key\nstring value\n";

/// Names by FieldType's numbers, which grow by kKinds for arrays, bounded sequences, sequences.
constexpr std::array<const char*, 23> kTypes = {
    "",      "",       "int8",    "uint8",   "int16", "uint16", "int32",  "uint32",
    "int64", "uint64", "float32", "float64", "",      "uint8",  "",       "bool",
    "byte",  "string", "wstring", "",        "",      "string", "wstring"};
constexpr std::uint8_t kNested = 1, kBoundedString = 21, kKinds = 48;

const Value& at(const Value& message, const std::string& path) {
  const Value* value = findValue(message, path);
  if (!value) throw MessageError("a description of a type has no " + path);
  return *value;
}
const std::string& textAt(const Value& message, const std::string& path) {
  return std::get<std::string>(at(message, path));
}

std::string brackets(std::uint8_t kind, std::uint64_t capacity) {
  switch (kind) {
    case 0:
      return "";
    case 1:
      return "[" + std::to_string(capacity) + "]";
    case 2:
      return "[<=" + std::to_string(capacity) + "]";
    default:
      return "[]";
  }
}

std::string lineOf(const Value& field) {
  const auto id = std::get<std::uint8_t>(at(field, "type.type_id"));
  const auto capacity = std::get<std::uint64_t>(at(field, "type.capacity"));
  const std::uint8_t kind = id / kKinds, base = id % kKinds;
  std::string type = base < kTypes.size() ? kTypes[base] : "";
  if (base == kNested) type = textAt(field, "type.nested_type_name");
  if (base == kBoundedString) {
    type += "<=" + std::to_string(std::get<std::uint64_t>(at(field, "type.string_capacity")));
  }
  if (type.empty() || kind > 3) {
    throw MessageError("field " + textAt(field, "name") + " has type " + std::to_string(id) +
                       ", which messages have not");
  }
  return type + brackets(kind, capacity) + " " + textAt(field, "name") + "\n";
}

/// One type's lines: its package's file, which has constants as well, or lines made of its fields.
std::string linesOf(const Value& type, const std::map<std::string, const Value*>& sources) {
  const auto source = sources.find(textAt(type, "type_name"));
  if (source != sources.end() && textAt(*source->second, "encoding") == "msg") {
    return textAt(*source->second, "raw_file_contents") + "\n";
  }
  std::string lines;
  for (const Value& field : std::get<Array>(at(type, "fields"))) lines += lineOf(field);
  return lines;
}

}  // namespace

Bytes typeDescriptionRequest(const std::string& type, const std::string& hash) {
  const Object request{
      {"type_name", type}, {"type_hash", hash}, {"include_type_sources", BoolByte{1}}};
  const Schema schema =
      Schema::parse("type_description_interfaces/GetTypeDescription_Request", kRequestFields);
  return CdrConversion(schema, schema).toRos2(encode(schema, Value(request)));
}

std::string definitionIn(const Bytes& reply) {
  const Schema schema =
      Schema::parse("type_description_interfaces/GetTypeDescription_Response", kReplyFields);
  const Value message = decode(schema, CdrConversion(schema, schema).toRos1(reply));
  if (std::get<BoolByte>(at(message, "successful")).byte == 0) {
    throw MessageError(textAt(message, "failure_reason"));
  }
  std::map<std::string, const Value*> sources;
  for (const Value& source : std::get<Array>(at(message, "type_sources"))) {
    sources[textAt(source, "type_name")] = &source;
  }
  std::string text = linesOf(at(message, "type_description.type_description"), sources);
  const auto& contained =
      std::get<Array>(at(message, "type_description.referenced_type_descriptions"));
  for (const Value& type : contained) {
    text += std::string(80, '=') + "\nMSG: " + textAt(type, "type_name") + "\n" +
            linesOf(type, sources);
  }
  return text;
}

}  // namespace afterglow::replay
