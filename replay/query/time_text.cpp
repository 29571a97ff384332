#include "replay/query/time_text.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <vector>

#include "replay/query/nearest.hpp"
#include "replay/query/regular_expression.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
/// Nanoseconds reach from 1677 to 2262.
constexpr std::int64_t kMostSeconds = std::numeric_limits<std::int64_t>::max() / kSecond_ns;

using Parts = std::vector<std::string>;  // of a match; those that take no part are empty

int number(const std::string& part) { return part.empty() ? 0 : std::stoi(part); }

/// ".25" -> 250'000'000.
std::int64_t fraction_ns(const std::string& part) {
  if (part.empty()) return 0;
  std::string digits = part.substr(1);
  digits.resize(9, '0');
  return std::stoll(digits);
}

/// Empty for what nanoseconds do not reach.
std::optional<Stamp> stampOf(std::int64_t seconds, std::int64_t rest_ns) {
  if (std::abs(seconds) >= kMostSeconds) return std::nullopt;
  return Stamp{seconds * kSecond_ns + rest_ns};
}

std::optional<Stamp> parseEpoch(const std::string& text) {
  static const RegularExpression pattern(R"((\d{1,10})(\.\d{1,9})?)");
  const Parts match = pattern.groups(text);
  if (match.empty()) return std::nullopt;
  return stampOf(std::stoll(match[1]), fraction_ns(match[2]));
}

/// Empty for a day or hour that there is not, which mktime would carry over.
std::optional<std::time_t> secondsOf(std::tm time, const std::string& zone) {
  const std::tm written = time;
  const std::time_t seconds = zone.empty() ? std::mktime(&time) : timegm(&time);
  const bool is_same = time.tm_mday == written.tm_mday && time.tm_mon == written.tm_mon &&
                       time.tm_min == written.tm_min && time.tm_sec == written.tm_sec &&
                       written.tm_hour < 24;
  if (!is_same) return std::nullopt;
  if (zone.empty() || zone == "Z") return seconds;
  const int minutes = std::stoi(zone.substr(1, 2)) * 60 + std::stoi(zone.substr(zone.size() - 2));
  return seconds + (zone[0] == '-' ? 60 : -60) * minutes;
}

constexpr std::time_t kYear1971 = 31'536'000;

/// A moment's date and time, and its zone.
struct SecondText {
  std::string text, zone;
};

SecondText secondText(std::time_t seconds, bool is_utc) {
  std::tm time{};
  is_utc ? gmtime_r(&seconds, &time) : localtime_r(&seconds, &time);
  std::array<char, 40> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%dT%H:%M:%S", &time);
  const long minutes = time.tm_gmtoff / 60;
  if (minutes == 0) return {date.data(), "Z"};
  return {date.data(), fmt::format("{}{:02}:{:02}", minutes < 0 ? '-' : '+',
                                   std::abs(minutes) / 60, std::abs(minutes) % 60)};
}

// ---------------------------------------------------------------------------------------- in words

constexpr std::array<const char*, 7> kWeekdays = {"sunday",   "monday", "tuesday", "wednesday",
                                                  "thursday", "friday", "saturday"};

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
  static const RegularExpression pattern(
      "(an?|\\d{1,9}(?:\\.\\d{1,9})?) ?"
      "(s|secs?|seconds?|m|mins?|minutes?|h|hours?|d|days?|w|weeks?) ago");
  const Parts match = pattern.groups(text);
  if (match.empty()) return std::nullopt;
  const double count = match[1][0] == 'a' ? 1 : std::stod(match[1]);
  const double seconds = count * secondsOfUnit(match[2][0]);
  if (seconds >= static_cast<double>(kMostSeconds) || now.ns < 0) return std::nullopt;
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
bool setTimeOfDay(std::tm& time, const Parts& match, std::size_t first) {
  time.tm_hour = number(match[first]);
  time.tm_min = number(match[first + 1]);
  time.tm_sec = number(match[first + 2]);
  const std::string& half = match[first + 3];
  if (half.empty()) return time.tm_hour < 24 && time.tm_min < 60 && time.tm_sec < 60;
  if (time.tm_hour < 1 || time.tm_hour > 12) return false;
  time.tm_hour = time.tm_hour % 12 + (half == "pm" ? 12 : 0);
  return time.tm_min < 60 && time.tm_sec < 60;
}

std::optional<Stamp> parseDay(const std::string& text, Stamp now) {
  static const RegularExpression pattern(
      "(?:(?:(last|on) )?(today|yesterday|[a-z]{3,9}))?(?: ?(?:at )?"
      "(\\d{1,2})(?::(\\d\\d))?(?::(\\d\\d))? ?(am|pm)?)?");
  const Parts match = pattern.groups(text);
  if (text.empty() || match.empty()) return std::nullopt;
  const bool is_bare_number = !match[3].empty() && match[4].empty() && match[6].empty();
  if (is_bare_number) return std::nullopt;
  const std::time_t seconds = now.ns / kSecond_ns;
  std::tm time{};
  localtime_r(&seconds, &time);
  const auto days = daysAgo(match[2], match[1] == "last", time.tm_wday);
  if (!days || !setTimeOfDay(time, match, 3)) return std::nullopt;
  time.tm_mday -= *days;
  time.tm_isdst = -1;
  return Stamp{std::int64_t{std::mktime(&time)} * kSecond_ns};
}

std::string withSingleBlanks(const std::string& text) {
  std::string words;
  for (const char c : text) {
    const bool is_blank = std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!is_blank) words += c;
    if (is_blank && (words.empty() || words.back() != ' ')) words += ' ';
  }
  return words;
}

/// As parseTime() takes them; empty for other words.
std::optional<Stamp> parseTimeWords(const std::string& text, Stamp now) {
  const std::string words = lowerCase(withSingleBlanks(text));
  if (words == "now") return now;
  if (const auto stamp = parseAgo(words, now)) return stamp;
  return parseDay(words, now);
}

}  // namespace

Stamp wallNow() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count()};
}

std::optional<Stamp> parseTime(const std::string& text, Stamp now) {
  if (const auto stamp = parseEpoch(text)) return stamp;
  static const RegularExpression pattern(
      R"((\d{4})-(\d\d)-(\d\d)(?:[T ](\d\d):(\d\d)(?::(\d\d)(\.\d{1,9})?)?(Z|[+-]\d\d:?\d\d)?)?)");
  const Parts match = pattern.groups(text);
  if (match.empty()) return parseTimeWords(text, now);
  std::tm time{};
  time.tm_year = number(match[1]) - 1900;
  time.tm_mon = number(match[2]) - 1;
  time.tm_mday = number(match[3]);
  time.tm_hour = number(match[4]);
  time.tm_min = number(match[5]);
  time.tm_sec = number(match[6]);
  time.tm_isdst = -1;
  // A simulation begins in 1970, and its times are printed in UTC: nobody means them as local.
  const bool is_simulated = match[1] == "1970" && match[8].empty();
  const auto seconds = secondsOf(time, is_simulated ? "Z" : match[8]);
  if (!seconds) return std::nullopt;
  return stampOf(*seconds, fraction_ns(match[7]));
}

std::string timeText(Stamp stamp) {
  std::time_t seconds = stamp.ns / kSecond_ns;
  std::int64_t rest_ns = stamp.ns % kSecond_ns;
  if (rest_ns < 0) {
    seconds -= 1;
    rest_ns += kSecond_ns;
  }
  const SecondText second = secondText(seconds, seconds < kYear1971);
  return fmt::format("{}.{:03}{}", second.text, rest_ns / 1'000'000, second.zone);
}

TimeParts timeParts(Stamp stamp) {
  const std::string text = timeText(stamp);
  return {text.substr(0, 10), text.substr(11, 8), text.substr(text.find_first_of("Z+-", 19))};
}

std::string dateNow() {
  const SecondText second = secondText(std::time(nullptr), true);
  return second.text + second.zone;
}

}  // namespace afterglow::replay
