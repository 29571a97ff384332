#include "nodes/console/behavior_search.hpp"

#include <utf8.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <vector>

namespace afterglow::nodes {
namespace {

/// The letters U+00C0 to U+017F, each without its accent.
constexpr char kWithoutAccents[] =
    "aaaaaaaceeeeiiiidnoooooxouuuuytsaaaaaaaceeeeiiiidnooooo/ouuuuytyaaaaaaccccccccdddd"
    "eeeeeeeeeegggggggghhhhiiiiiiiiiiiijjkkkllllllllllnnnnnnnnnoooooooorrrrrrssssssss"
    "ttttttuuuuuuuuuuuuwwyyyzzzzzzs";
static_assert(sizeof(kWithoutAccents) - 1 == 0x180 - 0xC0);

std::uint32_t folded(std::uint32_t letter) {
  if (letter >= 'A' && letter <= 'Z') return letter - 'A' + 'a';
  if (letter >= 0xC0 && letter < 0x180) {
    return static_cast<unsigned char>(kWithoutAccents[letter - 0xC0]);
  }
  const bool is_greek = letter >= 0x391 && letter <= 0x3A9;
  const bool is_cyrillic = letter >= 0x410 && letter <= 0x42F;
  if (is_greek || is_cyrillic) return letter + 0x20;
  if (letter >= 0x400 && letter <= 0x40F) return letter + 0x50;  // Cyrillic, too
  return letter;
}

bool isAccent(std::uint32_t letter) { return letter >= 0x300 && letter <= 0x36F; }

/// Splits at blanks; "quoted words" are one.
std::vector<std::string> searchWords(const std::string& text) {
  std::vector<std::string> words;
  std::string word;
  bool is_quoted = false;
  for (const char letter : text + " ") {
    if (letter == '"') {
      is_quoted = !is_quoted;
    } else if (!is_quoted && (letter == ' ' || letter == '\t' || letter == '\n')) {
      if (!word.empty()) words.push_back(word);
      word.clear();
    } else {
      word += letter;
    }
  }
  if (is_quoted && word.size() > 1) words.push_back(word.substr(0, word.size() - 1));
  return words;
}

using Texts = std::vector<std::string>;

struct SearchField {
  const char* name;
  Texts (*texts)(const BehaviorSummary&);
};

constexpr SearchField kSearchFields[] = {
    {"name", [](const BehaviorSummary& one) { return Texts{one.behavior.name}; }},
    {"outcome", [](const BehaviorSummary& one) { return Texts{one.behavior.outcome}; }},
    {"tree", [](const BehaviorSummary& one) { return Texts{one.behavior.tree_path}; }},
    {"robot", [](const BehaviorSummary& one) { return Texts{one.behavior.robot}; }},
    {"parameter", [](const BehaviorSummary& one) { return Texts{one.behavior.parameters}; }},
    {"tag", [](const BehaviorSummary& one) { return one.behavior.tags; }},
    {"note", [](const BehaviorSummary& one) { return one.notes; }},
    {"said",
     [](const BehaviorSummary& one) {
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

std::string foldedText(const std::string& text) {
  std::string result;
  result.reserve(text.size());
  auto at = text.begin();
  while (at != text.end()) {
    const auto bad = utf8::find_invalid(at, text.end());
    while (at != bad) {
      const std::uint32_t letter = utf8::unchecked::next(at);
      if (!isAccent(letter)) utf8::unchecked::append(folded(letter), std::back_inserter(result));
    }
    if (bad != text.end()) ++at;
  }
  return result;
}

std::string searchedText(const BehaviorSummary& one) {
  std::string all;
  for (const SearchField& field : kSearchFields) {
    for (const std::string& text : field.texts(one)) all += text + "\n";
  }
  return foldedText(all);
}

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
