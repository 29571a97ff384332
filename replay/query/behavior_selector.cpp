#include "replay/query/behavior_selector.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "replay/query/nearest.hpp"

namespace afterglow::replay {
namespace {

using Words = std::vector<std::string>;

const std::map<std::string, std::string> kOutcomes = {
    {"failed", "failure"},    {"failures", "failure"},    {"failing", "failure"},
    {"succeeded", "success"}, {"successful", "success"},  {"successes", "success"},
    {"crashed", kIncomplete}, {"unfinished", kIncomplete}};

const Words kCounts = {"second",  "third",  "fourth", "fifth", "sixth",
                       "seventh", "eighth", "ninth",  "tenth"};

Words wordsOf(const std::string& text) {
  std::istringstream stream(text);
  Words words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

bool isOneOf(const std::string& word, const Words& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// "second", "2nd": 2; 0: not an ordinal.
std::size_t countOf(const std::string& word) {
  const auto known = std::find(kCounts.begin(), kCounts.end(), word);
  if (known != kCounts.end()) return static_cast<std::size_t>(known - kCounts.begin()) + 2;
  const std::size_t digits = word.find_first_not_of("0123456789");
  if (digits == 0 || digits > 6 || digits == std::string::npos) return 0;
  const bool is_ordinal = isOneOf(word.substr(digits), {"st", "nd", "rd", "th"});
  return is_ordinal ? std::stoul(word.substr(0, digits)) : 0;
}

/// The meaning of the words.
struct Selection {
  std::size_t count = 1;
  bool from_oldest = false;
  std::string outcome;  ///< empty: any
  std::string name;     ///< empty: any
};

/// Takes "second last" from the front of the words.
void takeOrder(Words& words, Selection& selection) {
  if (words.empty()) return;
  if (const std::size_t count = countOf(lowerCase(words.front())); count > 0) {
    selection.count = count;
    selection.from_oldest = true;
    words.erase(words.begin());
  }
  if (words.empty()) return;
  const std::string word = lowerCase(words.front());
  const bool is_newest = isOneOf(word, {"last", "latest", "newest"});
  const bool is_oldest = isOneOf(word, {"first", "oldest", "earliest"});
  if (!is_newest && !is_oldest) return;
  selection.from_oldest = is_oldest;
  words.erase(words.begin());
}

Selection selectionOf(Words words, const std::set<std::string>& outcomes) {
  Selection selection;
  if (!words.empty() && lowerCase(words.front()) == "the") words.erase(words.begin());
  takeOrder(words, selection);
  if (!words.empty()) {
    const std::string word = lowerCase(words.front());
    const auto known = kOutcomes.find(word);
    const bool is_outcome =
        outcomes.count(word) > 0 || isOneOf(word, {"failure", "success", kIncomplete, "stopped"});
    if (known != kOutcomes.end() || is_outcome) {
      selection.outcome = known != kOutcomes.end() ? known->second : word;
      words.erase(words.begin());
    }
  }
  const bool ends_empty =
      !words.empty() && isOneOf(lowerCase(words.back()), {"one", "behavior", "behaviour"});
  if (ends_empty) words.pop_back();
  selection.name = fmt::format("{}", fmt::join(words, " "));
  return selection;
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::ptrdiff_t kMost = 8;
  const auto count = static_cast<std::ptrdiff_t>(names.size());
  return fmt::format("{}{}",
                     fmt::join(names.begin(), names.begin() + std::min(count, kMost), ", "),
                     count > kMost ? ", ..." : "");
}

/// The name in the store that is meant; throws if no name fits, or several do.
std::string nameMeant(const std::string& asked, const Words& names) {
  if (isOneOf(asked, names)) return asked;
  Words same, containing;
  for (const std::string& name : names) {
    if (lowerCase(name) == lowerCase(asked)) same.push_back(name);
    if (lowerCase(name).find(lowerCase(asked)) != std::string::npos) containing.push_back(name);
  }
  const Words& fitting = same.empty() ? containing : same;
  if (fitting.size() == 1) return fitting.front();
  if (!fitting.empty()) {
    throw StoreError("\"" + asked + "\" could be any of: " + listed(fitting));
  }
  const std::string hint = didYouMean(asked, names);
  throw StoreError("there is no behavior \"" + asked + "\"" +
                   (hint.empty() && !names.empty() ? "; there are: " + listed(names) : hint));
}

std::optional<Behavior> byIdentity(const Store& store, const std::string& text) {
  const bool is_number = !text.empty() && text.size() < 19 &&
                         text.find_first_not_of("0123456789") == std::string::npos;
  if (is_number) {
    auto behavior = store.behavior(std::stoll(text));
    if (!behavior) throw StoreError("there is no behavior " + text);
    return behavior;
  }
  const bool is_key =
      text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
  return is_key ? store.behaviorOfKey(text) : std::nullopt;
}

Behavior newestOf(const Store& store, const std::string& name) {
  BehaviorFilter filter;
  filter.name = name;
  filter.limit = 1;
  auto found = store.behaviors(filter);
  if (found.empty()) throw StoreError("there is no behavior \"" + name + "\"");
  return std::move(found.front());
}

/// "no behavior", "4 behaviors \"pick\"", "1 behavior \"pick\" with outcome failure"
std::string counted(std::size_t count, const Selection& selection) {
  return (count == 0 ? "no" : std::to_string(count)) + (count > 1 ? " behaviors" : " behavior") +
         (selection.name.empty() ? "" : " \"" + selection.name + "\"") +
         (selection.outcome.empty() ? "" : " with outcome " + selection.outcome);
}

}  // namespace

Behavior selectBehavior(const Store& store, const std::string& text) {
  const std::string words = fmt::format("{}", fmt::join(wordsOf(text), " "));
  if (words.empty()) throw StoreError("no behavior is named: give its id or its name");
  if (auto behavior = byIdentity(store, words)) return *behavior;
  std::vector<Behavior> behaviors = store.behaviors({});
  std::set<std::string> name_set, outcomes;
  for (const Behavior& behavior : behaviors) {
    name_set.insert(behavior.name);
    if (!behavior.outcome.empty()) outcomes.insert(lowerCase(behavior.outcome));
  }
  const Words names(name_set.begin(), name_set.end());
  if (name_set.count(words) > 0) return newestOf(store, words);
  Selection selection = selectionOf(wordsOf(words), outcomes);
  if (!selection.name.empty()) selection.name = nameMeant(selection.name, names);
  const auto is_other = [&](const Behavior& behavior) {
    const bool has_outcome =
        selection.outcome.empty() || lowerCase(behavior.outcome) == selection.outcome;
    return !has_outcome || (!selection.name.empty() && behavior.name != selection.name);
  };
  behaviors.erase(std::remove_if(behaviors.begin(), behaviors.end(), is_other), behaviors.end());
  if (selection.count == 0 || selection.count > behaviors.size()) {
    throw StoreError("there is no \"" + words + "\": the store has " +
                     counted(behaviors.size(), selection));
  }
  return selection.from_oldest ? behaviors[behaviors.size() - selection.count]
                               : behaviors[selection.count - 1];
}

}  // namespace afterglow::replay
