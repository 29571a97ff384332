#include "nodes/pages/page.hpp"

#include <openssl/evp.h>
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

/// Returns a letter as it may stand in a page; each byte of a longer character stands as it is.
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

std::string dataUri(const std::string& type, std::string_view bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                                   reinterpret_cast<const unsigned char*>(bytes.data()),
                                   static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return "data:" + type + ";base64," + text;
}

std::string imageUri(const calib::Picture& picture, int widest) {
  const std::vector<std::uint8_t> jpeg = calib::jpegOf(picture, widest);
  return dataUri("image/jpeg", {reinterpret_cast<const char*>(jpeg.data()), jpeg.size()});
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
