#include "replay/ask/phrase_match.hpp"

#include <algorithm>

#include "replay/query/nearest.hpp"

namespace afterglow::replay {
namespace {

constexpr double kLightWeight = 0.25, kHeavyWeight = 2;
constexpr double kGuessed = 0.8;  // what a guessed word is worth
constexpr std::size_t kSureLength = 6;  // letters: shorter words have too many neighbors
constexpr std::size_t kMostWords = 40;
constexpr std::size_t kLongestSlot = 5;

const std::set<std::string>& lightWords() {
  static const std::set<std::string> words{
      "a",  "an", "the", "did", "do",  "does", "you", "your", "is",  "was",  "were", "are", "have",
      "has", "had", "it", "that", "this", "up",  "to",  "of",   "in",  "at",   "on",   "and", "me",
      "i",  "for", "with", "be", "been", "them", "those", "these", "from", "into", "by", "down"};
  return words;
}

double weightOf(const std::string& word) {
  static const std::set<std::string> heavy{"what",  "why",  "where", "when", "who",
                                           "which", "how",  "not",   "never", "no"};
  if (heavy.count(word)) return kHeavyWeight;
  return lightWords().count(word) ? kLightWeight : 1;
}

double weightOf(const SpokenWords& words) {
  double sum = 0;
  for (const std::string& word : words) sum += weightOf(word);
  return sum;
}

/// Heard wrong: one letter of four, two of eight.
bool isNear(const std::string& heard, const std::string& known) {
  const std::size_t length = std::max(heard.size(), known.size());
  if (length < 4 || weightOf(heard) != 1 || weightOf(known) != 1) return false;
  return editDistance(heard, known) <= (length >= 8 ? 2 : 1);
}

/// Compares one sentence with one phrasing.
class Comparison {
 public:
  Comparison(const SpokenWords& heard, SpokenWords phrase)
      : heard_(heard), phrase_(std::move(phrase)), used_(heard.size(), false) {
    const auto slot = std::find(phrase_.begin(), phrase_.end(), kSlot);
    has_slot_ = slot != phrase_.end();
    if (has_slot_) phrase_.erase(slot);
  }

  PhraseMatch run() {
    for (const std::string& word : phrase_) take(word);
    const bool is_filled = !has_slot_ || fillSlot();
    // A slot that is filled is worth a word in both sentences, however long it is.
    const double slot = has_slot_ && is_filled ? 1 : 0;
    double left = 0;
    for (std::size_t i = 0; i < heard_.size(); ++i) {
      if (!used_[i]) left += weightOf(heard_[i]);
      if (!used_[i] && isTelling(heard_[i])) match_.is_sure = false;
    }
    const double of_heard = heard_weight_ + left + slot, of_phrase = weightOf(phrase_) + slot;
    match_.score = is_filled ? 2 * (matched_ + slot) / (of_heard + of_phrase) : 0;
    return match_;
  }

 private:
  void take(const std::string& word) {
    std::size_t at = find([&](const std::string& heard) { return heard == word; });
    double worth = 1;
    if (at == heard_.size()) {
      at = find([&](const std::string& heard) { return isNear(heard, word); });
      worth = kGuessed;
    }
    if (at == heard_.size()) {
      if (isTelling(word)) match_.is_sure = false;
      return;
    }
    used_[at] = true;
    matched_ += worth * weightOf(word);
    heard_weight_ += weightOf(word);
    if (worth < 1) match_.is_exact = false;
    if (worth < 1 && heard_[at].size() < kSureLength) match_.is_sure = false;
  }

  template <typename Test>
  std::size_t find(const Test& test) const {
    for (std::size_t i = 0; i < heard_.size(); ++i) {
      if (!used_[i] && test(heard_[i])) return i;
    }
    return heard_.size();
  }

  /// Fills the slot with all telling words that are left over, which must stand together.
  bool fillSlot() {
    std::size_t begin = heard_.size(), end = 0;
    for (std::size_t i = 0; i < heard_.size(); ++i) {
      if (used_[i] || !isTelling(heard_[i])) continue;
      begin = std::min(begin, i);
      end = i + 1;
    }
    if (begin >= end || end - begin > kLongestSlot) return false;
    for (std::size_t i = begin; i < end; ++i) {
      if (used_[i]) return false;
    }
    for (std::size_t i = begin; i < end; ++i) {
      used_[i] = true;
      match_.slot.push_back(heard_[i]);
    }
    return true;
  }

  const SpokenWords& heard_;
  SpokenWords phrase_;
  std::vector<bool> used_;
  bool has_slot_ = false;
  double matched_ = 0, heard_weight_ = 0;
  PhraseMatch match_;
};

/// The slot is kept as it is: no plain word has braces.
SpokenWords wordsOfPhrase(const std::string& phrasing, const QuestionBook& book) {
  const std::size_t slot = phrasing.find(kSlot);
  if (slot == std::string::npos) return plainWords(spokenWords(phrasing), book);
  SpokenWords words = plainWords(spokenWords(phrasing.substr(0, slot)), book);
  const SpokenWords rest =
      plainWords(spokenWords(phrasing.substr(slot + std::string(kSlot).size())), book);
  words.push_back(kSlot);
  words.insert(words.end(), rest.begin(), rest.end());
  return words;
}

}  // namespace

bool isAsking(const std::string& word) {
  static const std::set<std::string> askers{"what", "why",   "where", "when",
                                            "who",  "which", "how"};
  return askers.count(word) > 0;
}

bool isQuestion(const SpokenWords& words) {
  static const std::set<std::string> openers{"did", "do",  "does", "is",  "was", "were",
                                             "are", "has", "have", "had"};
  const bool asks = std::any_of(words.begin(), words.end(), isAsking);
  const bool opens = words.size() > 1 && openers.count(words[0]) > 0 && words[1] != "not";
  return asks || opens;
}

bool isTelling(const std::string& word) { return lightWords().count(word) == 0; }

std::vector<PhraseMatch> matchPhrases(const QuestionBook& book, const SpokenWords& words) {
  std::vector<PhraseMatch> matches;
  if (words.size() > kMostWords || !isQuestion(words)) return matches;
  for (std::size_t i = 0; i < book.questions.size(); ++i) {
    PhraseMatch best;
    for (const std::string& phrasing : book.questions[i].phrasings) {
      PhraseMatch match = Comparison(words, wordsOfPhrase(phrasing, book)).run();
      match.question = i;
      match.phrasing = phrasing;
      const auto rank = [](const PhraseMatch& m) { return m.score + (m.is_sure ? 1 : 0); };
      if (match.score > 0 && rank(match) > (best.score > 0 ? rank(best) : 0)) best = match;
    }
    if (best.score > 0) matches.push_back(best);
  }
  std::stable_sort(matches.begin(), matches.end(),
                   [](const auto& a, const auto& b) { return a.score > b.score; });
  return matches;
}

}  // namespace afterglow::replay
