#include "replay/ask/asking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

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

/// The words that name what is asked about: "why did you wave" -> wave.
SpokenWords namingWords(const SpokenWords& words) {
  SpokenWords naming = tellingWords(words);
  const auto isNoName = [](const auto& word) { return isAsking(word) || word == "about"; };
  naming.erase(std::remove_if(naming.begin(), naming.end(), isNoName), naming.end());
  return naming;
}

/// Takes an English ending off: "waving" and "waves" are "wav" as "wave" is.
std::string stemOf(const std::string& word) {
  for (const std::string ending : {"ing", "ed", "es", "s", "e"}) {
    const bool is_long = word.size() >= ending.size() + 3;
    if (is_long && endsWith(word, ending)) return word.substr(0, word.size() - ending.size());
  }
  return word;
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
  Asked asked{behaviors, said, now, {}, {}};
  if (words.empty()) return unknown("I heard no word. " + known(asked));
  if (const auto answer = answerBack(words, asked)) return *answer;
  pending_.clear();
  asked.time = takeTime(words, now);
  const bool is_order = hasWord(words, "show") || hasWord(words, "tell");
  words = plainWords(words, book_);
  if (is_order || isQuestion(words)) asked.named = namingWords(words);
  return askAnew(words, asked);
}

// ------------------------------------------------------------------------- what was asked back

std::optional<AskAnswer> Asking::answerBack(const SpokenWords& words, const Asked& asked) {
  const auto age = asked.now.ns - asked_back_.ns;
  if (pending_.empty() || age < 0 || age > kPatience_ns) return std::nullopt;
  const SpokenWords telling = tellingWords(words);
  if (telling.size() == 1 && (hasWord({"no", "neither", "none", "nothing"}, telling[0]))) {
    pending_.clear();
    return unknown("Then I do not know. " + known(asked));
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
  Matches matches = matchBook(words, asked);
  const bool is_sure = matches.is_sure && !matches.candidates.empty();
  if (!is_sure) {
    auto own = matchBehaviors(asked, false);
    if (own.empty() && matches.candidates.size() != 1) own = matchBehaviors(asked, true);
    if (!own.empty()) matches = {std::move(own), true, true};
  }
  if (!matches.is_known) return unknown("I do not know that. " + known(asked));
  if (matches.candidates.empty()) {
    return unknown(fmt::format("I remember nothing of that kind{}.",
                               asked.time.isGiven() ? " " + asked.time.text : std::string()));
  }
  const bool is_one = matches.is_sure && matches.candidates.size() == 1;
  return is_one ? found(matches.candidates[0], asked)
                : askBack(std::move(matches.candidates), asked.now);
}

Asking::Matches Asking::matchBook(const SpokenWords& words, const Asked& asked) const {
  const std::vector<PhraseMatch> matches = matchPhrases(book_, words);
  if (matches.empty() || matches[0].score < kThinkable) return {};
  const double best = matches[0].score;
  Matches found{{}, best >= kAccepted, true};
  for (const PhraseMatch& match : matches) {
    if (match.score < kThinkable || match.score < best - kAsGood) continue;
    // A match that is sure is not made doubtful by another that is not.
    if (matches[0].is_sure && !match.is_sure) continue;
    found.is_sure = found.is_sure && match.is_sure;
    const Question& question = book_.questions[match.question];
    for (const Behavior& behavior : behaviorsOf(match, asked)) {
      const bool is_known =
          std::any_of(found.candidates.begin(), found.candidates.end(),
                      [&](const auto& c) { return c.behavior.id == behavior.id; });
      if (is_known) continue;
      found.candidates.push_back(
          {behavior, question.may_move && match.is_exact, question.in_words,
           fmt::format("matched '{}' -> {}", match.phrasing, behavior.name)});
    }
  }
  return found;
}

/// Returns the behaviors whose own words hold all that is named; those that are called so alone
/// before others.
std::vector<Asking::Candidate> Asking::matchBehaviors(const Asked& asked, bool with_said) const {
  if (asked.named.empty()) return {};
  std::vector<Behavior> fitting, called;
  for (const Behavior& behavior : asked.behaviors) {
    if (!isAtTime(behavior, asked) || !names(ownWords(behavior, asked, with_said), asked.named)) {
      continue;
    }
    fitting.push_back(behavior);
    const SpokenWords name = plainWords(spokenWords(behavior.name), book_);
    if (name.size() == asked.named.size()) called.push_back(behavior);
  }
  std::vector<Candidate> candidates;
  for (const Behavior& behavior : newestOfEach(called.empty() ? fitting : called, asked)) {
    candidates.push_back(
        {behavior, false, false, fmt::format("'{}' names {}", joined(asked.named), behavior.name)});
  }
  return candidates;
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
    const bool has_slot = !match.slot.empty();
    if (has_slot && !names(ownWords(behavior, asked, true), match.slot)) continue;
    fitting.push_back(behavior);
  }
  if (is_any) return newestOfEach(fitting, asked);
  const auto one = pickOne(fitting, asked);
  return one ? std::vector<Behavior>{*one} : std::vector<Behavior>{};
}

/// Returns the one that a time picks, or the newest of each name.
std::vector<Behavior> Asking::newestOfEach(const std::vector<Behavior>& fitting,
                                           const Asked& asked) const {
  if (asked.time.which != SpokenTime::Which::Newest) {
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

/// Returns a behavior's name and tags; with what was said also that and its parameters.
std::string Asking::ownWords(const Behavior& behavior, const Asked& asked, bool with_said) {
  std::string text = behavior.name;
  for (const std::string& tag : behavior.tags) text += " " + tag;
  if (!with_said) return text;
  text += " " + behavior.parameters;
  for (const std::string& sentence : asked.said(behavior)) text += " " + sentence;
  return text;
}

/// Returns true if all that the person named occurs in the text.
bool Asking::names(const std::string& text, const SpokenWords& slot) const {
  SpokenWords known;
  for (std::size_t at = 0; at < text.size(); at += kLongestQuestion) {
    for (const auto& word : plainWords(spokenWords(text.substr(at, kLongestQuestion)), book_)) {
      known.push_back(stemOf(word));
    }
  }
  return std::all_of(slot.begin(), slot.end(), [&](const std::string& word) {
    return !isTelling(word) || hasWord(known, stemOf(word));
  });
}

// -------------------------------------------------------------------------------------- answers

AskAnswer Asking::found(const Candidate& candidate, const Asked& asked) {
  const Behavior& behavior = candidate.behavior;
  AskAnswer answer;
  answer.kind = AskAnswer::Kind::Found;
  answer.behavior = behavior;
  answer.may_move = candidate.may_move;
  answer.in_words = candidate.in_words;
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

/// Returns what can be asked: a phrasing of each question that a behavior answers, and the names of
/// others.
std::string Asking::known(const Asked& asked) const {
  std::vector<std::string> phrasings;
  const auto add = [&phrasings](const std::string& phrasing) {
    const bool is_new = std::count(phrasings.begin(), phrasings.end(), phrasing) == 0;
    if (is_new && phrasings.size() < kMostCandidates) phrasings.push_back(phrasing);
  };
  std::set<std::string> answered;
  for (const Question& question : book_.questions) {
    const bool is_there =
        std::any_of(asked.behaviors.begin(), asked.behaviors.end(),
                    [&](const Behavior& behavior) { return behavior.name == question.behavior; });
    if (!is_there || question.phrasings.empty()) continue;
    add(question.phrasings[0]);
    answered.insert(question.behavior);
  }
  for (const Behavior& behavior : asked.behaviors) {
    if (answered.count(behavior.name) == 0) add("show me " + shortened(behavior.name));
  }
  return phrasings.empty() ? "I remember nothing yet."
                           : "You can ask me " + listOf(phrasings) + ".";
}

}  // namespace afterglow::replay
