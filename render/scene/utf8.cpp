#include "render/scene/utf8.hpp"

#include <cstddef>

namespace afterglow::render {
namespace {

/// Bytes of the character that a first byte begins; 0: none.
std::size_t lengthFrom(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first < 0xe0) return 2;
  if (first >= 0xe0 && first < 0xf0) return 3;
  if (first >= 0xf0 && first < 0xf5) return 4;
  return 0;
}

bool isCharacter(char32_t value, std::size_t length) {
  const char32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = value >= 0xd800 && value < 0xe000;
  return value >= least[length] && value <= 0x10ffff && !surrogate;
}

}  // namespace

std::u32string decodeUtf8(const std::string& text) {
  std::u32string out;
  for (std::size_t i = 0; i < text.size();) {
    const auto first = static_cast<unsigned char>(text[i]);
    const std::size_t length = lengthFrom(first);
    char32_t value = length == 1 ? first : first & (0x7fu >> length);
    bool whole = length > 0 && i + length <= text.size();
    for (std::size_t k = 1; whole && k < length; ++k) {
      const auto next = static_cast<unsigned char>(text[i + k]);
      whole = (next & 0xc0u) == 0x80u;
      value = value << 6 | (next & 0x3fu);
    }
    whole = whole && isCharacter(value, length);
    out.push_back(whole ? value : kReplacement);
    i += whole ? length : 1;
  }
  return out;
}

}  // namespace afterglow::render
