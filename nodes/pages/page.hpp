/// \file
/// Pages for people, made from data and the templates in assets/pages: the one place that makes
/// HTML.
///
/// A page's data as the template library asks for it, name by name.
#pragma once

#include <deque>
#include <kainjow/mustache.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace afterglow::calib {
struct Picture;
}

namespace afterglow::nodes {

using PageData = nlohmann::ordered_json;

/// A page that needs no network and no script, well-formed as XML. `data` has to hold `page_title`;
/// `version` is added. The template is Mustache, in which a name can be followed by how its value
/// is written:
///
///     {{mm:.2f}}          by fmt's format
///     {{mm:.2f mm}}       with a unit
///     {{m:100*.1f}}       multiplied before
///     {{mm:two}}          with two digits: 0.034, 3.4, 34
///     {{mm:.2f|-}}        a text for a value that is not there
///     {{#count:any}}      a section of what is not 0, "" or empty
///     {{#topics:each}}    a section of each member of an object; `key` is its name
///
/// null, false, "" and empty lists are left out, as names are that no data holds.
/// Throws std::logic_error for a template that does not exist or is malformed.
std::string makePage(const std::string& name, PageData data);

/// Escapes a text so that it may stand in a page's text and attributes. Control characters, which
/// no page may hold, become U+FFFD, and so do bytes that are no UTF-8.
std::string escaped(const std::string& text);

/// `bytes` as a URI; `type`: "image/jpeg".
std::string dataUri(const std::string& type, std::string_view bytes);
/// The picture as JPEG in a data URI, at most `widest` pixels wide.
std::string imageUri(const calib::Picture& picture, int widest);

/// "0.0034", "0.034", "0.34", "3.4", "34".
std::string twoDigits(double value);

/// An item for notice.html.
struct NoticeItem {
  std::string subject, text;  ///< the subject can be empty
};
PageData notice(const std::string& heading, const std::vector<NoticeItem>& items, bool is_bad);

/// Makes the data for figure.html: a drawing of drawing.hpp with its heading, its caption and what
/// its looks mean.
PageData figure(const std::string& heading, const PageData& drawing, const std::string& caption,
                const PageData& legend = PageData::array());

/// Makes the data for legend.html: the meaning of a look of style.css.
PageData legendEntry(const std::string& look, const std::string& meaning);

/// The templates and the style sheet, by file name.
struct EmbeddedPage {
  const char* name;  ///< nullptr ends the list
  const char* text;
};
extern const EmbeddedPage kEmbeddedPages[];

/// Values are looked up in the innermost section first. The data has to outlive it.
class PageContext : public kainjow::mustache::basic_context<std::string> {
 public:
  using Value = kainjow::mustache::data;

  explicit PageContext(const PageData& data) : sections_{&data} {}

  void push(const Value* value) override;
  void pop() override { sections_.pop_back(); }
  /// A name with its format (makePage). Null where there is no value. Throws fmt::format_error or
  /// std::logic_error for a format that does not fit.
  const Value* get(const std::string& tag) const override;
  /// Throws std::logic_error for one that is not embedded.
  const Value* get_partial(const std::string& name) const override;

 private:
  const PageData* find(const std::string& path) const;
  const Value* keep(Value value, const PageData* data) const;
  const Value* keepData(const PageData& data) const;
  const Value* each(const PageData& object) const;

  std::vector<const PageData*> sections_;
  // What was handed out: the library holds on to pointers while it renders.
  mutable std::deque<Value> values_;
  mutable std::deque<PageData> lists_;
  mutable std::unordered_map<const Value*, const PageData*> data_;
};

}  // namespace afterglow::nodes
