#include "nodes/pages/page.hpp"

#include <utf8.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>

#include "calib/number_text.hpp"
#include "calib/picture.hpp"
#include "nodes/pages/page_context.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kReplacement = "\xEF\xBF\xBD";  // U+FFFD

/// As it may stand in a page; of a longer character, each byte stands as it is.
std::string inPage(char letter) {
  switch (letter) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    default:
      const bool is_control = static_cast<unsigned char>(letter) < 0x20 && letter != '\n';
      return is_control ? kReplacement : std::string(1, letter);
  }
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  static constexpr char kLetters[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = unsigned(bytes[i]) << 16;
    if (left > 1) group |= unsigned(bytes[i + 1]) << 8;
    if (left > 2) group |= unsigned(bytes[i + 2]);
    text += kLetters[group >> 18];
    text += kLetters[group >> 12 & 63];
    text += left > 1 ? kLetters[group >> 6 & 63] : '=';
    text += left > 2 ? kLetters[group & 63] : '=';
  }
  return text;
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string result;
  for (auto at = text.begin(); at != text.end();) {
    const auto bad = utf8::find_invalid(at, text.end());
    for (; at != bad; ++at) result += inPage(*at);
    if (bad == text.end()) break;
    result += kReplacement;
    ++at;
  }
  return result;
}

std::string imageUri(const calib::Picture& picture, int widest) {
  return "data:image/jpeg;base64," + base64(calib::jpegOf(picture, widest));
}

std::string twoDigits(double value) {
  const int decimals = value < 0.0095  ? 4
                       : value < 0.095 ? 3
                       : value < 0.95  ? 2
                       : value < 9.5   ? 1
                                       : 0;
  return calib::fixedText(value, decimals);
}

std::string makePage(const std::string& name, PageData data) {
  data["version"] = AFTERGLOW_VERSION;
  PageContext context(data);
  kainjow::mustache::mustache page(context.get_partial(name)->string_value());
  page.set_custom_escape(escaped);
  const std::string text = page.render(context);
  if (!page.is_valid()) throw std::logic_error(name + ": " + page.error_message());
  return text + "\n";
}

PageData notice(const std::string& heading, const std::vector<NoticeItem>& items, bool is_bad) {
  PageData list = PageData::array();
  for (const NoticeItem& item : items) {
    list.push_back({{"subject", item.subject}, {"text", item.text}});
  }
  return {{"heading", heading}, {"items", list}, {"is_bad", is_bad}};
}

PageData figure(const std::string& heading, const PageData& drawing, const std::string& caption,
                const PageData& legend) {
  return {{"heading", heading}, {"drawing", drawing}, {"caption", caption}, {"legend", legend}};
}

PageData legendEntry(const std::string& look, const std::string& meaning) {
  return {{"look", look}, {"meaning", meaning}};
}

}  // namespace afterglow::nodes
