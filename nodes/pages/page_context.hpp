/// \file
/// A page's data as the template library asks for it, name by name.
#pragma once

#include <deque>
#include <kainjow/mustache.hpp>
#include <string>
#include <unordered_map>
#include <vector>

#include "nodes/pages/page.hpp"

namespace afterglow::nodes {

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
