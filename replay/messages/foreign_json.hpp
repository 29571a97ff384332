/// \file
/// JSON that somebody else wrote. nlohmann::json parses any depth, but copies and prints it by
/// recursion: 100,000 nested arrays take the stack.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace afterglow::replay {

/// Deeper than this is refused.
constexpr int kDeepestJson = 100;

/// Returns true if objects and arrays are nested no deeper than kDeepestJson. Says nothing on
/// whether it is JSON at all.
inline bool isShallowJson(const std::string& text) {
  int depth = 0;
  bool is_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_string && c == '\\') ++i;
    if (c == '"') is_string = !is_string;
    if (is_string) continue;
    if ((c == '[' || c == '{') && ++depth > kDeepestJson) return false;
    if (c == ']' || c == '}') --depth;
  }
  return true;
}

/// Json::is_discarded() for what is no JSON or too deep.
template <typename Json = nlohmann::json>
Json parseForeignJson(const std::string& text) {
  if (!isShallowJson(text)) return Json(Json::value_t::discarded);
  return Json::parse(text, nullptr, false);
}

}  // namespace afterglow::replay
