#include "nodes/pages/page_context.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/number_text.hpp"

namespace afterglow::nodes {
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
