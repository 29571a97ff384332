// What people and scripts ask a store for: filters, behaviors in words, times. An input is a letter,
// which says what the rest is.
#include <nlohmann/json.hpp>
#include <string>

#include "replay/query/behavior_selector.hpp"
#include "replay/query/filter.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/fuzz/target.hpp"

namespace afterglow::fuzz::filter_fuzz {
namespace {

using namespace replay;

const nlohmann::json& document() {
  static const nlohmann::json fields = {
      {"name", "pick"},
      {"pose", {{"position", {{"x", 0.5}, {"y", "nan"}}}}},
      {"points", {{{"x", 1}}, {{"x", -2.5}}, {{"y", nullptr}}}},
      {"list", {1, "two", {3, 4}, false}}};
  return fields;
}

void parse(const std::string& text) {
  try {
    Filter::parse(text, Filter::Over::Behaviors);
  } catch (const FilterError&) {
  }
  try {
    Filter::parse(text, Filter::Over::Messages).matches(document());
  } catch (const FilterError&) {
  }
}

void select(const std::string& text) {
  static const auto store = [] {
    auto made = openMemoryStore();
    const std::int64_t recording = made->beginImport({});
    for (const char* name : {"pick", "pick", "Place", "drive round"}) {
      Behavior behavior;
      behavior.recording = recording;
      behavior.name = name;
      behavior.outcome = "success";
      made->addBehavior(behavior);
    }
    made->finishImport(recording);
    return made;
  }();
  try {
    selectBehavior(*store, text);
  } catch (const StoreError&) {
  }
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(filter) {
  if (size == 0) return;
  const std::string text(data + 1, data + size);
  if (data[0] == 'b') {
    select(text);
  } else if (data[0] == 't') {
    parseTime(text, {1'700'000'000'000'000'000});
  } else {
    parse(text);
  }
}

}  // namespace afterglow::fuzz::filter_fuzz
