#include "nodes/console/behavior_index.hpp"

#include <utf8.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <iterator>
#include <utility>
#include <vector>

#include "replay/store/behavior_edit.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kPublishedAtOnce = 50, kMostDetails = 32;
constexpr auto kPeriod = std::chrono::seconds(1);

/// Behaviors that are equal by this look the same to everybody.
bool isSame(const replay::Behavior& some, const replay::Behavior& other,
            const std::vector<std::string>& notes) {
  return some.name == other.name && some.outcome == other.outcome && some.tags == other.tags &&
         some.begin == other.begin && some.end == other.end && some.parent == other.parent &&
         some.attempt == other.attempt && some.tree_path == other.tree_path &&
         some.parameters == other.parameters && some.remarks == other.remarks &&
         some.robot == other.robot && notes == replay::notesOf(other);
}

std::shared_ptr<IndexedBehavior> indexedOf(const replay::Behavior& behavior) {
  auto indexed = std::make_shared<IndexedBehavior>();
  static_cast<BehaviorSummary&>(*indexed) = summaryOf(behavior);
  indexed->searched = searchedText(*indexed);
  return indexed;
}

/// Null if the behavior is no longer in the store.
std::shared_ptr<BehaviorDetail> detailOf(const replay::Store& store, const IndexedBehaviors& all,
                                         std::shared_ptr<const IndexedBehavior> one) {
  const auto behavior = store.behavior(one->behavior.id);
  if (!behavior) return nullptr;
  auto detail = std::make_shared<BehaviorDetail>();
  detail->behavior = *behavior;
  detail->summary = std::move(one);
  for (const auto& other : all) {
    if (other->behavior.parent == behavior->id) detail->children.push_back(other);
    if (isAttemptOf(other->behavior, *behavior)) detail->attempts.push_back(other);
  }
  addStory(store, *detail);
  return detail;
}

}  // namespace

BehaviorIndex::BehaviorIndex(const replay::Store& store)
    : store_(store),
      all_(std::make_shared<const IndexedBehaviors>()),
      thread_(kPeriod, [this] { read(); }) {}

std::shared_ptr<const IndexedBehaviors> BehaviorIndex::all() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return all_;
}

std::shared_ptr<const IndexedBehavior> BehaviorIndex::find(std::int64_t id) const {
  const auto behaviors = all();
  const auto found = std::find_if(behaviors->begin(), behaviors->end(),
                                  [id](const auto& one) { return one->behavior.id == id; });
  return found == behaviors->end() ? nullptr : *found;
}

std::string BehaviorIndex::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

void BehaviorIndex::read() {
  std::string problem;
  try {
    readAll();
  } catch (const std::exception& error) {
    problem = error.what();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  problem_ = problem;
}

void BehaviorIndex::readAll() {
  const std::vector<replay::Behavior> behaviors = store_.behaviors({});
  Known left;
  for (const replay::Behavior& behavior : behaviors) {
    const auto found = known_.find(behavior.id);
    const bool is_known =
        found != known_.end() && isSame(found->second->behavior, behavior, found->second->notes);
    left[behavior.id] = is_known ? found->second : indexedOf(behavior);
    // What still grows is read again every time.
    if (!is_known || replay::isOpen(behavior)) is_heard_.erase(behavior.id);
  }
  known_ = std::move(left);
  publish(behaviors);
  readMessages(behaviors);
}

void BehaviorIndex::readMessages(const std::vector<replay::Behavior>& behaviors) {
  std::size_t read = 0;
  for (const replay::Behavior& behavior : behaviors) {
    if (is_heard_.count(behavior.id) != 0) continue;
    if (!thread_.sleepUntil({})) return;  // the program ends
    auto indexed = std::make_shared<IndexedBehavior>(*known_[behavior.id]);
    addMessages(store_, *indexed);
    indexed->searched = searchedText(*indexed);
    known_[behavior.id] = std::move(indexed);
    is_heard_[behavior.id] = true;
    if (++read % kPublishedAtOnce == 0) publish(behaviors);
  }
  if (read > 0) publish(behaviors);
}

void BehaviorIndex::publish(const std::vector<replay::Behavior>& order) {
  auto all = std::make_shared<IndexedBehaviors>();
  all->reserve(order.size());
  for (const replay::Behavior& behavior : order) all->push_back(known_[behavior.id]);
  const std::lock_guard<std::mutex> lock(mutex_);
  all_ = std::move(all);
}

std::shared_ptr<const BehaviorDetail> BehaviorDetails::find(std::int64_t id) {
  const auto one = index_.find(id);
  if (!one) return nullptr;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto kept = std::find_if(kept_.begin(), kept_.end(),
                                   [&](const auto& detail) { return detail->summary == one; });
    if (kept != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, kept);
      return kept_.front();
    }
  }
  const std::shared_ptr<const BehaviorDetail> detail = detailOf(store_, *index_.all(), one);
  const std::lock_guard<std::mutex> lock(mutex_);
  kept_.remove_if([id](const auto& other) { return other->behavior.id == id; });
  if (!detail) return nullptr;
  kept_.push_front(detail);
  if (kept_.size() > kMostDetails) kept_.pop_back();
  return detail;
}

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
