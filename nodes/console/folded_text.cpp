#include "nodes/console/folded_text.hpp"

#include <utf8.h>

#include <cstdint>
#include <iterator>

namespace afterglow::nodes {
namespace {

/// Of U+00C0 to U+017F, each letter without its accent.
constexpr char kWithoutAccents[] =
    "aaaaaaaceeeeiiiidnoooooxouuuuytsaaaaaaaceeeeiiiidnooooo/ouuuuytyaaaaaaccccccccdddd"
    "eeeeeeeeeegggggggghhhhiiiiiiiiiiiijjkkkllllllllllnnnnnnnnnoooooooorrrrrrssssssss"
    "ttttttuuuuuuuuuuuuwwyyyzzzzzzs";
static_assert(sizeof(kWithoutAccents) - 1 == 0x180 - 0xC0);

std::uint32_t folded(std::uint32_t letter) {
  if (letter >= 'A' && letter <= 'Z') return letter - 'A' + 'a';
  if (letter >= 0xC0 && letter < 0x180) {
    return static_cast<unsigned char>(kWithoutAccents[letter - 0xC0]);
  }
  const bool is_greek = letter >= 0x391 && letter <= 0x3A9;
  const bool is_cyrillic = letter >= 0x410 && letter <= 0x42F;
  if (is_greek || is_cyrillic) return letter + 0x20;
  if (letter >= 0x400 && letter <= 0x40F) return letter + 0x50;  // Cyrillic, too
  return letter;
}

bool isAccent(std::uint32_t letter) { return letter >= 0x300 && letter <= 0x36F; }

}  // namespace

std::string foldedText(const std::string& text) {
  std::string result;
  result.reserve(text.size());
  auto at = text.begin();
  while (at != text.end()) {
    const auto bad = utf8::find_invalid(at, text.end());
    while (at != bad) {
      const std::uint32_t letter = utf8::unchecked::next(at);
      if (!isAccent(letter)) utf8::unchecked::append(folded(letter), std::back_inserter(result));
    }
    if (bad != text.end()) ++at;
  }
  return result;
}

std::vector<std::string> searchWords(const std::string& text) {
  std::vector<std::string> words;
  std::string word;
  bool is_quoted = false;
  for (const char letter : text + " ") {
    if (letter == '"') {
      is_quoted = !is_quoted;
    } else if (!is_quoted && (letter == ' ' || letter == '\t' || letter == '\n')) {
      if (!word.empty()) words.push_back(word);
      word.clear();
    } else {
      word += letter;
    }
  }
  if (is_quoted && word.size() > 1) words.push_back(word.substr(0, word.size() - 1));
  return words;
}

}  // namespace afterglow::nodes
