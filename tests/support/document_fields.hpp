/// \file
/// Documents to fill field by field, and what a serialized message holds by path.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/field_edit.hpp"

namespace afterglow::test {

/// Every field zero, every string and list empty.
inline replay::Value zeroDocument(const replay::Schema& schema) {
  return decode(schema, replay::Bytes(schema.minimumSize(0)));
}

/// The field at "goal.trajectory.header"; throws std::out_of_range if there is none.
inline replay::Value& fieldAt(replay::Value& document, const std::string& path) {
  const std::size_t dot = std::min(path.find('.'), path.size());
  for (auto& [name, value] : std::get<replay::Object>(document)) {
    if (name != path.substr(0, dot)) continue;
    return dot == path.size() ? value : fieldAt(value, path.substr(dot + 1));
  }
  throw std::out_of_range("no field " + path);
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
