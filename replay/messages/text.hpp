/// \file
/// Small helpers for texts. ASCII alone.
#pragma once

#include <cctype>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace afterglow::replay {

inline bool beginsWith(std::string_view text, std::string_view beginning) {
  return text.substr(0, beginning.size()) == beginning;
}

inline bool endsWith(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

constexpr std::string_view kBlanks = " \t\r\f\v";  ///< blanks within a line

/// Returns the text without blanks at its ends.
inline std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// Returns the parts between the marks, without empty ones.
inline std::vector<std::string> splitAt(char mark, const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t at = text.find_first_not_of(mark); at != std::string::npos;) {
    const std::size_t end = text.find(mark, at);
    parts.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(mark, end);
  }
  return parts;
}

/// Returns the text with small letters for its capitals.
inline std::string lowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// "1 drive", "2 drives".
inline std::string counted(std::uint64_t count, const std::string& thing) {
  return std::to_string(count) + " " + thing + (count == 1 ? "" : "s");
}

}  // namespace afterglow::replay
