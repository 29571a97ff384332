#include "render/scene/utf8.hpp"

#include <utf8.h>

#include <iterator>

namespace afterglow::render {

std::u32string decodeUtf8(const std::string& text) {
  std::u32string out;
  for (auto at = text.begin(); at != text.end();) {
    const auto bad = utf8::find_invalid(at, text.end());
    utf8::utf8to32(at, bad, std::back_inserter(out));
    if (bad == text.end()) break;
    out.push_back(kReplacement);
    at = bad + 1;
  }
  return out;
}

}  // namespace afterglow::render
