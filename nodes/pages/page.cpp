#include "nodes/pages/page.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <utf8.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "calib/number_text.hpp"
#include "calib/picture.hpp"

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

namespace {

const PageData kNoData;

bool isAny(const PageData& data) {
  if (data.is_number()) return data.get<double>() != 0;
  if (data.is_string()) return !data.get_ref<const std::string&>().empty();
  return data.is_boolean() ? data.get<bool>() : !data.empty();
}

std::string numberText(double value, std::string format) {
  const std::size_t times = format.find('*');
  if (times != std::string::npos) {
    value *= calib::numberFromText(format.substr(0, times)).value();
    format.erase(0, times + 1);
  }
  if (!std::isfinite(value)) return "–";
  if (format.rfind("two", 0) == 0) return twoDigits(value) + format.substr(3);
  const std::size_t unit = std::min(format.find_first_not_of("+-.0123456789") + 1, format.size());
  std::string text =
      fmt::vformat("{:" + format.substr(0, unit) + "}", fmt::make_format_args(value));
  // Never "-0.00".
  if (text.find_first_of("123456789") == std::string::npos && text[0] == '-') text.erase(0, 1);
  return text + format.substr(unit);
}

std::string valueText(const PageData& data, const std::string& format) {
  if (data.is_string()) return data.get<std::string>();
  if (format.empty() && data.is_number_integer()) return data.dump();
  // Ten digits are enough for any drawing.
  return numberText(data.get<double>(), format.empty() ? ".10g" : format);
}

/// The member that a path "a.b.c" leads to, or null.
const PageData* memberAt(const PageData* data, const std::string& path) {
  for (std::size_t from = 0; data != nullptr && from <= path.size();) {
    const std::size_t to = std::min(path.find('.', from), path.size());
    const auto member =
        data->is_object() ? data->find(path.substr(from, to - from)) : data->end();
    data = member == data->end() ? nullptr : &*member;
    from = to + 1;
  }
  return data;
}

}  // namespace

void PageContext::push(const Value* value) {
  const auto known = data_.find(value);
  sections_.push_back(known == data_.end() ? &kNoData : known->second);
}

const PageContext::Value* PageContext::get(const std::string& tag) const {
  const std::size_t bar = tag.find('|');
  const std::string name = tag.substr(0, bar);
  const std::size_t colon = name.find(':');
  const std::string format = colon == std::string::npos ? "" : name.substr(colon + 1);
  const PageData* data = find(name.substr(0, colon));
  if (data == nullptr || data->is_null()) {
    return bar == std::string::npos ? nullptr : keep(Value(tag.substr(bar + 1)), nullptr);
  }
  if (format == "any") return keep(Value(isAny(*data)), data);
  if (format == "each") return each(*data);
  const bool is_text = data->is_number() || (data->is_string() && isAny(*data));
  return is_text ? keep(Value(valueText(*data, format)), data) : keepData(*data);
}

const PageContext::Value* PageContext::get_partial(const std::string& name) const {
  for (const EmbeddedPage* page = kEmbeddedPages; page->name != nullptr; ++page) {
    if (name != page->name) continue;
    // The end of its last line is the one of the line it stands in.
    const std::string part = page->text;
    return keep(Value(part.substr(0, part.find_last_not_of('\n') + 1)), nullptr);
  }
  throw std::logic_error("no page or part of one is called " + name);
}

const PageData* PageContext::find(const std::string& path) const {
  if (path == ".") return sections_.back();
  for (auto section = sections_.rbegin(); section != sections_.rend(); ++section) {
    const PageData* data = memberAt(*section, path);
    if (data != nullptr) return data;
  }
  return nullptr;
}

const PageContext::Value* PageContext::keep(Value value, const PageData* data) const {
  values_.push_back(std::move(value));
  data_[&values_.back()] = data == nullptr ? &kNoData : data;
  return &values_.back();
}

/// Only whether there is something, and how many: what is in it, `find` looks up.
const PageContext::Value* PageContext::keepData(const PageData& data) const {
  if (!data.is_array()) return keep(Value(isAny(data)), &data);
  Value items(Value::type::list);
  for (std::size_t i = 0; i < data.size(); ++i) items.push_back(Value(true));
  const Value* const kept = keep(std::move(items), &data);
  for (std::size_t i = 0; i < data.size(); ++i) data_[&kept->list_value()[i]] = &data[i];
  return kept;
}

const PageContext::Value* PageContext::each(const PageData& object) const {
  PageData items = PageData::array();
  for (const auto& [key, member] : object.items()) {
    PageData item = member.is_object() ? member : PageData::object({{"value", member}});
    item["key"] = key;
    items.push_back(std::move(item));
  }
  lists_.push_back(std::move(items));
  return keepData(lists_.back());
}

}  // namespace afterglow::nodes
