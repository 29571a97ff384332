#include "replay/ask/asking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "replay/messages/text.hpp"
#include "replay/query/nearest.hpp"

namespace afterglow::replay {
namespace {

constexpr double kAccepted = 0.8;   // below it is asked back
constexpr double kThinkable = 0.6;  // below nothing is asked
constexpr double kAsGood = 0.1;     // two that differ by less both fit
constexpr std::int64_t kPatience_ns = 30'000'000'000;  // for an answer to what was asked back
constexpr std::size_t kMostCandidates = 4;
constexpr std::size_t kLongestPhrase = 80;  // of a name or sentence that is spoken

bool hasWord(const SpokenWords& words, const std::string& word) {
  return std::count(words.begin(), words.end(), word) > 0;
}

/// The words that say something in an answer: "the first one" -> first.
SpokenWords tellingWords(const SpokenWords& words) {
  SpokenWords telling;
  std::copy_if(words.begin(), words.end(), std::back_inserter(telling),
               [](const auto& word) { return isTelling(word) && word != "one"; });
  return telling;
}

std::string shortened(const std::string& text) {
  return text.size() <= kLongestPhrase ? text : text.substr(0, kLongestPhrase) + "...";
}

std::string listOf(const std::vector<std::string>& things) {
  std::string text;
  for (std::size_t i = 0; i < things.size(); ++i) {
    const char* between = i == 0 ? "" : i + 1 < things.size() ? ", " : " or ";
    text += between + things[i];
  }
  return text;
}

}  // namespace

Stamp wallBegin(const Behavior& behavior) {
  return behavior.wall_begin.ns != 0 ? behavior.wall_begin : behavior.begin;
}

std::string ageText(Stamp then, Stamp now) {
  const auto seconds = (now.ns - then.ns) / 1'000'000'000;
  const auto said = [](std::int64_t count, const char* unit) {
    return counted(static_cast<std::uint64_t>(count), unit) + " ago";
  };
  if (seconds < 60) return "just now";
  if (seconds < 90 * 60) return said(seconds / 60, "minute");
  if (seconds < 36 * 3600) return said(seconds / 3600, "hour");
  return said(seconds / 86400, "day");
}

AskAnswer Asking::ask(const std::string& text, const std::vector<Behavior>& behaviors,
                      const SentencesOf& said, Stamp now) {
  if (text.size() > kLongestQuestion) {
    return unknown(fmt::format("That is too long for a question: {} letters.", text.size()));
  }
  SpokenWords words = spokenWords(text);
  Asked asked{behaviors, said, now, {}};
  if (words.empty()) return unknown("I heard no word. " + known());
  if (const auto answer = answerBack(words, asked)) return *answer;
  pending_.clear();
  asked.time = takeTime(words, now);
  return askAnew(plainWords(words, book_), asked);
}

// ------------------------------------------------------------------------- what was asked back

std::optional<AskAnswer> Asking::answerBack(const SpokenWords& words, const Asked& asked) {
  const auto age = asked.now.ns - asked_back_.ns;
  if (pending_.empty() || age < 0 || age > kPatience_ns) return std::nullopt;
  const SpokenWords telling = tellingWords(words);
  if (telling.size() == 1 && (hasWord({"no", "neither", "none", "nothing"}, telling[0]))) {
    pending_.clear();
    return unknown("Then I do not know. " + known());
  }
  const auto candidate = chosen(telling);
  if (!candidate) return std::nullopt;
  pending_.clear();
  return found(*candidate, asked);
}

/// "yes" to one; "first", "second", "last"; a name that only one of them has.
std::optional<Asking::Candidate> Asking::chosen(const SpokenWords& words) const {
  if (words.size() == 1) {
    static const SpokenWords places{"first", "second", "third", "fourth"};
    const auto place = std::find(places.begin(), places.end(), words[0]) - places.begin();
    if (place < static_cast<std::ptrdiff_t>(std::min(places.size(), pending_.size()))) {
      return pending_[static_cast<std::size_t>(place)];
    }
    if (words[0] == "last") return pending_.back();
    const bool agrees = hasWord({"yes", "yeah", "yep", "right", "correct", "sure"}, words[0]);
    if (agrees && pending_.size() == 1) return pending_.front();
  }
  const Candidate* named = nullptr;
  for (const Candidate& candidate : pending_) {
    const SpokenWords name = plainWords(tellingWords(spokenWords(candidate.behavior.name)), book_);
    if (name.empty() || name != plainWords(words, book_)) continue;
    if (named != nullptr) return std::nullopt;
    named = &candidate;
  }
  return named != nullptr ? std::optional<Candidate>(*named) : std::nullopt;
}

// ----------------------------------------------------------------------------- a new question

AskAnswer Asking::askAnew(const SpokenWords& words, const Asked& asked) {
  const auto which = asked.time.which;
  const bool is_relative =
      which == SpokenTime::Which::Before || which == SpokenTime::Which::After;
  if (is_relative && !last_) {
    return unknown("I have not answered anything yet that '" + asked.time.text + "' could mean.");
  }
  std::vector<PhraseMatch> matches = matchPhrases(book_, words);
  if (matches.empty() || matches[0].score < kThinkable) {
    return unknown("I do not know that. " + known());
  }
  const double best = matches[0].score;
  std::vector<Candidate> candidates;
  bool is_sure = best >= kAccepted;
  for (const PhraseMatch& match : matches) {
    if (match.score < kThinkable || match.score < best - kAsGood) continue;
    // A match that is sure is not made doubtful by another that is not.
    if (matches[0].is_sure && !match.is_sure) continue;
    is_sure = is_sure && match.is_sure;
    const Question& question = book_.questions[match.question];
    for (const Behavior& behavior : behaviorsOf(match, asked)) {
      const bool is_known = std::any_of(candidates.begin(), candidates.end(), [&](const auto& c) {
        return c.behavior.id == behavior.id;
      });
      if (is_known) continue;
      candidates.push_back({match.question, behavior, question.may_move && match.is_exact,
                            fmt::format("matched '{}' -> {}", match.phrasing, behavior.name)});
    }
  }
  if (candidates.empty()) {
    return unknown(fmt::format("I remember nothing of that kind{}.",
                               asked.time.isGiven() ? " " + asked.time.text : std::string()));
  }
  if (is_sure && candidates.size() == 1) return found(candidates[0], asked);
  return askBack(std::move(candidates), asked.now);
}

/// Returns the behaviors that a match may mean: one for a behavior by name, the newest of each name
/// for any.
std::vector<Behavior> Asking::behaviorsOf(const PhraseMatch& match, const Asked& asked) const {
  const std::string& name = book_.questions[match.question].behavior;
  const bool is_any = name == kAnyBehavior;
  std::vector<Behavior> fitting;
  for (const Behavior& behavior : asked.behaviors) {
    const bool is_named = is_any || lowerCase(behavior.name) == lowerCase(name);
    if (!is_named || !isAtTime(behavior, asked)) continue;
    if (!names(behavior, match.slot, asked.said)) continue;
    fitting.push_back(behavior);
  }
  if (!is_any || asked.time.which != SpokenTime::Which::Newest) {
    const auto one = pickOne(fitting, asked);
    return one ? std::vector<Behavior>{*one} : std::vector<Behavior>{};
  }
  std::vector<Behavior> of_each;
  for (const Behavior& behavior : fitting) {
    const bool is_known = std::any_of(of_each.begin(), of_each.end(), [&](const auto& other) {
      return other.name == behavior.name;
    });
    if (!is_known) of_each.push_back(behavior);
  }
  return of_each;
}

/// `fitting`: the newest first, as they are.
std::optional<Behavior> Asking::pickOne(const std::vector<Behavior>& fitting,
                                        const Asked& asked) const {
  if (fitting.empty()) return std::nullopt;
  switch (asked.time.which) {
    case SpokenTime::Which::FromOldest:
      if (asked.time.count >= fitting.size()) return std::nullopt;
      return fitting[fitting.size() - 1 - asked.time.count];
    case SpokenTime::Which::After:
      return fitting.back();
    default:
      return fitting.front();
  }
}

bool Asking::isAtTime(const Behavior& behavior, const Asked& asked) const {
  const Stamp begin = wallBegin(behavior);
  const auto length = behavior.end ? behavior.end->ns - behavior.begin.ns : std::int64_t{0};
  if (asked.time.since && begin.ns + length < asked.time.since->ns) return false;
  if (asked.time.until && begin.ns >= asked.time.until->ns) return false;
  if (asked.time.which == SpokenTime::Which::Before) return begin.ns < wallBegin(*last_).ns;
  if (asked.time.which == SpokenTime::Which::After) return begin.ns > wallBegin(*last_).ns;
  return true;
}

/// Returns true if all that the person named occurs in the behavior.
bool Asking::names(const Behavior& behavior, const SpokenWords& slot,
                   const SentencesOf& said) const {
  if (slot.empty()) return true;
  std::string text = behavior.name + " " + behavior.parameters;
  for (const std::string& tag : behavior.tags) text += " " + tag;
  for (const std::string& sentence : said(behavior)) text += " " + sentence;
  SpokenWords known;
  for (std::size_t at = 0; at < text.size(); at += kLongestQuestion) {
    const SpokenWords words = plainWords(spokenWords(text.substr(at, kLongestQuestion)), book_);
    known.insert(known.end(), words.begin(), words.end());
  }
  return std::all_of(slot.begin(), slot.end(), [&](const std::string& word) {
    return !isTelling(word) || hasWord(known, word);
  });
}

// -------------------------------------------------------------------------------------- answers

AskAnswer Asking::found(const Candidate& candidate, const Asked& asked) {
  const Behavior& behavior = candidate.behavior;
  AskAnswer answer;
  answer.kind = AskAnswer::Kind::Found;
  answer.behavior = behavior;
  answer.may_move = candidate.may_move;
  answer.in_words = book_.questions[candidate.question].in_words;
  answer.why = candidate.why;
  std::string said;
  for (const std::string& sentence : asked.said(behavior)) said += " " + shortened(sentence);
  answer.sentence = fmt::format("That was {}, {}{}", shortened(behavior.name),
                                ageText(wallBegin(behavior), asked.now),
                                said.empty() ? "; I said nothing." : "; I said:" + said);
  last_ = behavior;
  return answer;
}

AskAnswer Asking::askBack(std::vector<Candidate> candidates, Stamp now) {
  if (candidates.size() > kMostCandidates) candidates.resize(kMostCandidates);
  AskAnswer answer;
  answer.kind = AskAnswer::Kind::AskedBack;
  std::vector<std::string> spoken;
  for (const Candidate& candidate : candidates) {
    answer.candidates.push_back(candidate.behavior.name);
    spoken.push_back(fmt::format("{}, {}", shortened(candidate.behavior.name),
                                 ageText(wallBegin(candidate.behavior), now)));
    answer.why += (answer.why.empty() ? "" : "; ") + candidate.why;
  }
  answer.sentence = "Do you mean " + listOf(spoken) + "?";
  pending_ = std::move(candidates);
  asked_back_ = now;
  return answer;
}

AskAnswer Asking::unknown(const std::string& sentence) const {
  AskAnswer answer;
  answer.sentence = sentence;
  answer.why = "no match";
  return answer;
}

/// Returns what can be asked: a phrasing of each question.
std::string Asking::known() const {
  std::vector<std::string> phrasings;
  for (const Question& question : book_.questions) {
    if (phrasings.size() < kMostCandidates && !question.phrasings.empty()) {
      phrasings.push_back(question.phrasings[0]);
    }
  }
  return phrasings.empty() ? "I know no questions." : "You can ask me " + listOf(phrasings) + ".";
}

}  // namespace afterglow::replay
