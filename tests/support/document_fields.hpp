/// \file
/// Documents to fill, and the fields of serialized messages by path.
#pragma once

#include <string>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/field_edit.hpp"

namespace afterglow::test {

/// Every field zero, every string and list empty.
inline replay::Value zeroDocument(const replay::Schema& schema) {
  return decode(schema, replay::Bytes(schema.minimumSize(0)));
}

/// All `time` fields, nested and in arrays, as paths with [] ("transforms[].header.stamp"), in the
/// definition's order.
inline std::vector<replay::FieldPath> timeFields(const replay::Schema& schema,
                                                 std::size_t type_index = 0,
                                                 const std::string& prefix = {}) {
  std::vector<replay::FieldPath> found;
  for (const replay::Field& field : schema.types()[type_index].fields) {
    const bool is_array = field.arity != replay::Field::Arity::Single;
    const std::string path = prefix + field.name + (is_array ? "[]" : "");
    if (field.type == replay::FieldType::Time) found.push_back(replay::FieldPath::parse(path));
    if (field.type != replay::FieldType::Message) continue;
    for (auto& inner : timeFields(schema, field.message, path + ".")) found.push_back(inner);
  }
  return found;
}

/// All stamps a path names, in ns.
inline std::vector<std::int64_t> stampsAt(const replay::Schema& schema, const replay::Bytes& bytes,
                                          const std::string& path) {
  std::vector<std::int64_t> found;
  for (const auto& span : findField(schema, bytes, replay::FieldPath::parse(path))) {
    found.push_back(readTime(bytes, span)->ns);
  }
  return found;
}

/// The first string a path names.
inline std::string stringAt(const replay::Schema& schema, const replay::Bytes& bytes,
                            const std::string& path) {
  return readString(bytes, findField(schema, bytes, replay::FieldPath::parse(path)).at(0));
}

}  // namespace afterglow::test
