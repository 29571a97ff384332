#include "replay/query/time_words.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <ctime>
#include <regex>

namespace afterglow::replay {
namespace {

constexpr std::int64_t kWordSecond_ns = 1'000'000'000;

constexpr std::array<const char*, 7> kWeekdays = {"sunday",   "monday", "tuesday", "wednesday",
                                                  "thursday", "friday", "saturday"};

std::string inSmallLetters(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

double secondsOfUnit(char letter) {
  switch (letter) {
    case 's':
      return 1;
    case 'm':
      return 60;
    case 'h':
      return 3600;
    case 'd':
      return 86400;
    default:
      return 7 * 86400;
  }
}

std::optional<Stamp> parseAgo(const std::string& text, Stamp now) {
  static const std::regex pattern(
      "(an?|\\d{1,9}(?:\\.\\d{1,9})?) ?"
      "(s|secs?|seconds?|m|mins?|minutes?|h|hours?|d|days?|w|weeks?) ago");
  std::smatch match;
  if (!std::regex_match(text, match, pattern)) return std::nullopt;
  const double count = match[1].str()[0] == 'a' ? 1 : std::stod(match[1].str());
  const double seconds = count * secondsOfUnit(match[2].str()[0]);
  return Stamp{now.ns - static_cast<std::int64_t>(seconds * 1e9)};
}

/// How many days ago a day's name means; seen from `weekday`.
std::optional<int> daysAgo(const std::string& day, bool is_last, int weekday) {
  if (day.empty() || day == "today") return 0;
  if (day == "yesterday") return 1;
  for (int i = 0; i < 7; ++i) {
    const std::string name = kWeekdays[static_cast<std::size_t>(i)];
    if (day != name && day != name.substr(0, 3)) continue;
    const int days = (weekday - i + 7) % 7;
    return is_last && days == 0 ? 7 : days;
  }
  return std::nullopt;
}

/// Hour, minute, second of "14", "00", "30", "pm" into the time; false if there is no such time.
bool setTimeOfDay(std::tm& time, const std::smatch& match, std::size_t first) {
  const auto number = [&](std::size_t i) {
    return match[i].matched ? std::stoi(match[i].str()) : 0;
  };
  time.tm_hour = number(first);
  time.tm_min = number(first + 1);
  time.tm_sec = number(first + 2);
  const std::string half = match[first + 3].str();
  if (half.empty()) return time.tm_hour < 24 && time.tm_min < 60 && time.tm_sec < 60;
  if (time.tm_hour < 1 || time.tm_hour > 12) return false;
  time.tm_hour = time.tm_hour % 12 + (half == "pm" ? 12 : 0);
  return time.tm_min < 60 && time.tm_sec < 60;
}

std::optional<Stamp> parseDay(const std::string& text, Stamp now) {
  static const std::regex pattern(
      "(?:(?:(last|on) )?(today|yesterday|[a-z]{3,9}))?(?: ?(?:at )?"
      "(\\d{1,2})(?::(\\d\\d))?(?::(\\d\\d))? ?(am|pm)?)?");
  std::smatch match;
  if (text.empty() || !std::regex_match(text, match, pattern)) return std::nullopt;
  const bool is_bare_number = match[3].matched && !match[4].matched && !match[6].matched;
  if (is_bare_number) return std::nullopt;
  const std::time_t seconds = now.ns / kWordSecond_ns;
  std::tm time{};
  localtime_r(&seconds, &time);
  const auto days = daysAgo(match[2].str(), match[1] == "last", time.tm_wday);
  if (!days || !setTimeOfDay(time, match, 3)) return std::nullopt;
  time.tm_mday -= *days;
  time.tm_isdst = -1;
  return Stamp{std::int64_t{std::mktime(&time)} * kWordSecond_ns};
}

}  // namespace

std::optional<Stamp> parseTimeWords(const std::string& text, Stamp now) {
  static const std::regex blanks("\\s+");
  const std::string words = inSmallLetters(std::regex_replace(text, blanks, " "));
  if (words == "now") return now;
  if (const auto stamp = parseAgo(words, now)) return stamp;
  return parseDay(words, now);
}

}  // namespace afterglow::replay
