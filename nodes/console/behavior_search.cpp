#include "nodes/console/behavior_search.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "nodes/console/folded_text.hpp"

namespace afterglow::nodes {
namespace {

using Texts = std::vector<std::string>;

struct SearchField {
  const char* name;
  Texts (*texts)(const IndexedBehavior&);
};

constexpr SearchField kSearchFields[] = {
    {"name", [](const IndexedBehavior& one) { return Texts{one.behavior.name}; }},
    {"outcome", [](const IndexedBehavior& one) { return Texts{one.behavior.outcome}; }},
    {"tree", [](const IndexedBehavior& one) { return Texts{one.behavior.tree_path}; }},
    {"robot", [](const IndexedBehavior& one) { return Texts{one.behavior.robot}; }},
    {"parameter", [](const IndexedBehavior& one) { return Texts{one.behavior.parameters}; }},
    {"tag", [](const IndexedBehavior& one) { return one.behavior.tags; }},
    {"note", [](const IndexedBehavior& one) { return one.notes; }},
    {"said",
     [](const IndexedBehavior& one) {
       Texts texts;
       for (const replay::Utterance& sentence : one.said) texts.push_back(sentence.text);
       return texts;
     }},
};

/// A word of the search, folded.
struct Wanted {
  std::string text;
  const SearchField* field = nullptr;  ///< none: any
  bool is_id = false;

  bool isIn(const IndexedBehavior& one) const {
    if (is_id) return std::to_string(one.behavior.id) == text;
    if (!field) return one.searched.find(text) != std::string::npos;
    const Texts texts = field->texts(one);
    return std::any_of(texts.begin(), texts.end(), [this](const std::string& in) {
      return foldedText(in).find(text) != std::string::npos;
    });
  }
};

Wanted wantedBy(const std::string& word) {
  const std::string folded = foldedText(word);
  const std::size_t colon = folded.find(':');
  if (colon == std::string::npos) return {folded};
  const std::string name = folded.substr(0, colon), value = folded.substr(colon + 1);
  if (name == "id") return {value, nullptr, true};
  for (const SearchField& field : kSearchFields) {
    if (name == field.name) return {value, &field};
  }
  return {folded};
}

bool isFound(const IndexedBehavior& one, const BehaviorSearch& search,
             const std::vector<Wanted>& words) {
  const replay::Behavior& behavior = one.behavior;
  if (!search.name.empty() && behavior.name != search.name) return false;
  if (!search.outcome.empty() && behavior.outcome != search.outcome) return false;
  if (search.from && one.end < *search.from) return false;
  if (search.to && behavior.begin >= *search.to) return false;
  if (search.of_these && search.of_these->count(behavior.id) == 0) return false;
  return std::all_of(words.begin(), words.end(),
                     [&](const Wanted& word) { return word.isIn(one); });
}

}  // namespace

FoundBehaviors searchBehaviors(const IndexedBehaviors& all, const BehaviorSearch& search) {
  std::vector<Wanted> words;
  for (const std::string& word : searchWords(search.words)) words.push_back(wantedBy(word));
  FoundBehaviors found;
  bool is_behind = !search.before;
  for (const auto& one : all) {
    const bool is_wanted = isFound(*one, search, words);
    if (is_wanted) ++found.matching;
    if (is_wanted && is_behind && found.behaviors.size() < search.limit) {
      found.behaviors.push_back(one);
    }
    is_behind = is_behind || one->behavior.id == search.before;
  }
  return found;
}

}  // namespace afterglow::nodes
