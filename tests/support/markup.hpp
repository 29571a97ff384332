/// \file
/// Whether a page is well-formed.
#pragma once

#include <cctype>
#include <string>
#include <vector>

namespace afterglow::test {

/// The name of a tag whose inside is ` name="value"...`, empty if it is malformed.
inline std::string tagName(const std::string& inside) {
  std::size_t at = 0;
  const auto word = [&] {
    const std::size_t from = at;
    while (at < inside.size() && (std::isalnum(inside[at]) != 0 || inside[at] == '-')) ++at;
    return inside.substr(from, at - from);
  };
  const std::string name = word();
  while (at < inside.size()) {
    if (inside[at++] != ' ' || word().empty() || inside.compare(at, 2, "=\"") != 0) return "";
    at = inside.find('"', at + 2);
    if (at == std::string::npos) return "";
    ++at;
  }
  return name;
}

/// What is wrong with the markup: a tag that closes none, an unquoted attribute, a stray sign.
/// Empty if every tag is closed in order.
inline std::string markupProblem(const std::string& text) {
  std::vector<std::string> open;
  std::size_t at = text.find('\n') + 1;  // after the doctype
  while ((at = text.find('<', at)) != std::string::npos) {
    const std::size_t end = text.find('>', at);
    if (end == std::string::npos) return "no end of " + text.substr(at, 40);
    std::string inside = text.substr(at + 1, end - at - 1);
    const bool closes = inside[0] == '/', is_empty = inside.back() == '/';
    if (closes) inside.erase(0, 1);
    if (is_empty) inside.pop_back();
    const std::string name = tagName(inside);
    if (name.empty()) return "malformed: " + inside.substr(0, 200);
    if (closes) {
      if (open.empty() || open.back() != name) return "closes none: " + inside;
      open.pop_back();
    } else if (!is_empty) {
      open.push_back(name);
    }
    at = end;
  }
  return open.empty() ? "" : "never closed: " + open.back();
}

}  // namespace afterglow::test
