#include "replay/ask/spoken_words.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <ctime>
#include <map>

#include "replay/messages/topic_name.hpp"
#include "replay/query/nearest.hpp"
#include "replay/query/time_text.hpp"

namespace afterglow::replay {
namespace {

/// "didn't" and "didnt": recognizers leave the apostrophe out.
bool isNegated(const std::string& word) {
  static const std::set<std::string> verbs{"did",  "do",  "does", "was",  "were",  "is",    "are",
                                           "have", "has", "had",  "could", "would", "should"};
  if (endsWith(word, "n't")) return verbs.count(word.substr(0, word.size() - 3)) > 0;
  return endsWith(word, "nt") && verbs.count(word.substr(0, word.size() - 2)) > 0;
}

void addWord(SpokenWords& words, const std::string& word) {
  static const std::vector<std::pair<std::string, std::string>> endings{
      {"'s", "is"}, {"'d", "did"}, {"'ve", "have"}, {"'re", "are"}};
  if (isNegated(word)) {
    words.push_back(word.substr(0, word.size() - (endsWith(word, "n't") ? 3 : 2)));
    words.push_back("not");
    return;
  }
  std::string stem = word, rest;
  for (const auto& [ending, meaning] : endings) {
    if (!endsWith(word, ending)) continue;
    stem = word.substr(0, word.size() - ending.size());
    rest = meaning;
  }
  std::string letters;
  for (const char c : stem) {
    if (c != '\'') letters += c;
  }
  if (!letters.empty()) words.push_back(letters);
  if (!rest.empty()) words.push_back(rest);
}

/// Typewritten apostrophes for typeset ones.
std::string withPlainApostrophes(std::string text) {
  for (const char* typeset : {"\u2019", "\u2018"}) {
    for (std::size_t at = 0; (at = text.find(typeset, at)) != std::string::npos;) {
      text.replace(at, std::string(typeset).size(), "'");
    }
  }
  return text;
}

}  // namespace

SpokenWords spokenWords(const std::string& text) {
  if (text.size() > kLongestQuestion) return {};
  const std::string plain = lowerCase(withPlainApostrophes(text));
  SpokenWords words;
  std::string word;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const auto c = static_cast<unsigned char>(plain[i]);
    const bool is_time = c == ':' && i > 0 && i + 1 < plain.size() &&
                         std::isdigit(static_cast<unsigned char>(plain[i - 1])) != 0 &&
                         std::isdigit(static_cast<unsigned char>(plain[i + 1])) != 0;
    if (c >= 0x80 || std::isalnum(c) != 0 || c == '\'' || is_time) {
      word += plain[i];
    } else if (!word.empty()) {
      addWord(words, word);
      word.clear();
    }
  }
  if (!word.empty()) addWord(words, word);
  return words;
}

SpokenWords plainWords(const SpokenWords& words, const QuestionBook& book) {
  SpokenWords plain;
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::size_t taken = 1;
    std::string word = words[i], meaning;
    for (std::size_t length = 3; length >= 1; --length) {  // "for what reason" before "for"
      if (i + length > words.size()) continue;
      const std::string several =
          joined(SpokenWords(words.begin() + static_cast<std::ptrdiff_t>(i),
                             words.begin() + static_cast<std::ptrdiff_t>(i + length)));
      const auto found = book.synonyms.find(several);
      if (found == book.synonyms.end()) continue;
      word = found->second;
      taken = length;
      break;
    }
    if (taken > 1 || book.fillers.count(word) == 0) plain.push_back(word);
    i += taken - 1;
  }
  return plain;
}

std::string joined(const SpokenWords& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

namespace {

constexpr std::int64_t kMinute_ns = 60'000'000'000;
constexpr std::int64_t kHour_ns = 60 * kMinute_ns;
constexpr std::size_t kLongestTime = 4;  // words

struct PartOfDay {
  int begin_hour, end_hour;
};

const std::map<std::string, PartOfDay>& partsOfDay() {
  static const std::map<std::string, PartOfDay> parts{
      {"morning", {4, 12}}, {"noon", {11, 13}}, {"afternoon", {12, 18}}, {"evening", {17, 24}},
      {"night", {18, 30}}};
  return parts;
}

/// "two" -> "2"; other words as they are.
std::string withDigits(const std::string& word) {
  static const std::array<const char*, 13> numbers{"zero", "one",   "two",   "three", "four",
                                                   "five", "six",   "seven", "eight", "nine",
                                                   "ten",  "eleven", "twelve"};
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    if (word == numbers[i]) return std::to_string(i);
  }
  static const std::map<std::string, const char*> tens{
      {"fifteen", "15"}, {"twenty", "20"}, {"thirty", "30"}, {"forty", "40"}, {"fifty", "50"},
      {"sixty", "60"},   {"ninety", "90"}};
  const auto found = tens.find(word);
  return found == tens.end() ? word : found->second;
}

bool isWeekday(const std::string& word) {
  static const std::array<const char*, 7> days{"sunday",   "monday", "tuesday", "wednesday",
                                               "thursday", "friday", "saturday"};
  return std::count(days.begin(), days.end(), word) > 0;
}

std::optional<std::size_t> ordinal(const std::string& word) {
  static const std::array<const char*, 5> ordinals{"first", "second", "third", "fourth", "fifth"};
  const auto found = std::find(ordinals.begin(), ordinals.end(), word);
  if (found == ordinals.end()) return std::nullopt;
  return static_cast<std::size_t>(found - ordinals.begin());
}

/// The hour of the day that `days` after today's.
Stamp hourOfDay(Stamp now, int days, int hour) {
  const std::time_t seconds = now.ns / 1'000'000'000;
  std::tm time{};
  localtime_r(&seconds, &time);
  time.tm_mday += days;
  time.tm_hour = hour;
  time.tm_min = time.tm_sec = 0;
  time.tm_isdst = -1;
  return Stamp{std::int64_t{std::mktime(&time)} * 1'000'000'000};
}

/// Finds the words of one kind after the other in a sentence and takes them out.
class TimeReader {
 public:
  TimeReader(SpokenWords& words, Stamp now) : words_(words), now_(now) {}

  SpokenTime read() {
    for (std::size_t at = 0; at < words_.size();) {
      const std::size_t length = lengthAt(at);
      if (length == 0) {
        ++at;
        continue;
      }
      const auto begin = words_.begin() + static_cast<std::ptrdiff_t>(at);
      const auto end = begin + static_cast<std::ptrdiff_t>(length);
      time_.text += (time_.text.empty() ? "" : " ") + joined(SpokenWords(begin, end));
      words_.erase(begin, end);
    }
    return time_;
  }

 private:
  std::string word(std::size_t at) const { return at < words_.size() ? words_[at] : ""; }

  /// Returns how many words from there say a time, which is noted; 0: none.
  std::size_t lengthAt(std::size_t at) {
    if (const std::size_t length = relation(at)) return length;
    if (const std::size_t length = partOfDay(at)) return length;
    if (const std::size_t length = clockTime(at)) return length;
    return place(at);
  }

  /// Reads "before that", "after this".
  std::size_t relation(std::size_t at) {
    const bool is_before = word(at) == "before", is_after = word(at) == "after";
    const std::string next = word(at + 1);
    const bool points = next == "that" || next == "this" || next == "it";
    if (!is_before && !(is_after && points)) return 0;
    if (is_before && !points && at + 1 < words_.size()) return 0;
    time_.which = is_before ? SpokenTime::Which::Before : SpokenTime::Which::After;
    return points ? 2 : 1;
  }

  /// Reads "this morning", "yesterday evening", "at noon", "last night", "today", "yesterday".
  std::size_t partOfDay(std::size_t at) {
    const std::string first = word(at);
    const bool is_day = first == "today" || first == "yesterday";
    const auto part = partsOfDay().find(word(at + 1));
    const bool is_led = first == "this" || first == "at" || first == "last" || is_day;
    const int days = first == "yesterday" || first == "last" ? -1 : 0;
    if (part != partsOfDay().end() && is_led) {
      setSpan(days, part->second);
      return 2;
    }
    if (!is_day || word(at + 1) == "at" || isDigit(word(at + 1))) return 0;
    setSpan(days, {0, 24});
    return 1;
  }

  void setSpan(int days, const PartOfDay& part) {
    time_.since = hourOfDay(now_, days, part.begin_hour);
    time_.until = hourOfDay(now_, days, part.end_hour);
  }

  static bool isDigit(const std::string& word) {
    return !word.empty() && std::isdigit(static_cast<unsigned char>(word[0])) != 0;
  }

  /// Reads what replay/query/time_text.hpp understands: "10 minutes ago", "9:30", "last tuesday".
  std::size_t clockTime(std::size_t at) {
    if (word(at) == "half" && word(at + 2) == "hour" && word(at + 3) == "ago") {
      around(Stamp{now_.ns - kHour_ns / 2});
      return 4;
    }
    const std::size_t led = word(at) == "at" ? 1 : 0;
    const std::size_t most = std::min(kLongestTime, words_.size() - at - led);
    for (std::size_t length = most; length >= 1; --length) {
      std::string text;
      for (std::size_t i = 0; i < length; ++i) {
        text += (i > 0 ? " " : "") + withDigits(word(at + led + i));
      }
      if (const auto stamp = timeOf(text, at + led, length)) {
        isWeekday(word(at + led + length - 1)) ? day(*stamp) : around(*stamp);
        return led + length;
      }
    }
    return 0;
  }

  /// Empty for words that are times only by chance ("sat", "5").
  std::optional<Stamp> timeOf(const std::string& text, std::size_t at, std::size_t length) const {
    const bool has_digit = std::any_of(text.begin(), text.end(), [](unsigned char c) {
      return std::isdigit(c) != 0;
    });
    const std::string last = word(at + length - 1);
    if (last != "ago" && !isWeekday(last) && !has_digit) return std::nullopt;
    if (length == 1 && has_digit && text.find(':') == std::string::npos) return std::nullopt;
    return parseTime(text, now_);
  }

  /// People say times roughly: the farther back, the more.
  void around(Stamp stamp) {
    const std::int64_t rough = std::clamp(std::abs(now_.ns - stamp.ns) / 4, kMinute_ns, kHour_ns);
    time_.since = Stamp{stamp.ns - rough};
    time_.until = Stamp{stamp.ns + rough};
  }

  void day(Stamp begin) {
    time_.since = begin;
    time_.until = Stamp{begin.ns + 24 * kHour_ns};
  }

  /// "the first time", "the last time", "last", "second time"
  std::size_t place(std::size_t at) {
    const bool has_time = word(at + 1) == "time" || word(at + 1) == "thing";
    const bool is_last = word(at) == "last" || word(at) == "latest";
    const auto count = ordinal(word(at));
    if (!is_last && !(count && (has_time || *count == 0))) return 0;
    time_.which = is_last ? SpokenTime::Which::Last : SpokenTime::Which::FromOldest;
    time_.count = count.value_or(0);
    return has_time ? 2 : 1;
  }

  SpokenWords& words_;
  const Stamp now_;
  SpokenTime time_;
};

}  // namespace

SpokenTime takeTime(SpokenWords& words, Stamp now) { return TimeReader(words, now).read(); }

}  // namespace afterglow::replay
