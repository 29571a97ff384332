#include "replay/query/time_text.hpp"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <ctime>
#include <regex>

#include "replay/query/time_words.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

int number(const std::ssub_match& match) { return match.matched ? std::stoi(match.str()) : 0; }

/// ".25" -> 250'000'000.
std::int64_t fraction_ns(const std::ssub_match& match) {
  if (!match.matched) return 0;
  std::string digits = match.str().substr(1);
  digits.resize(9, '0');
  return std::stoll(digits);
}

std::optional<Stamp> parseEpoch(const std::string& text) {
  static const std::regex pattern(R"((\d{1,10})(\.\d{1,9})?)");
  std::smatch match;
  if (!std::regex_match(text, match, pattern)) return std::nullopt;
  return Stamp{std::stoll(match[1].str()) * kSecond_ns + fraction_ns(match[2])};
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

/// UTC.
std::string secondText(std::time_t seconds) {
  std::tm time{};
  gmtime_r(&seconds, &time);
  std::array<char, 40> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%dT%H:%M:%S", &time);
  return date.data();
}

}  // namespace

Stamp wallNow() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count()};
}

std::optional<Stamp> parseTime(const std::string& text, Stamp now) {
  if (const auto stamp = parseEpoch(text)) return stamp;
  static const std::regex pattern(
      R"((\d{4})-(\d\d)-(\d\d)(?:[T ](\d\d):(\d\d)(?::(\d\d)(\.\d{1,9})?)?(Z|[+-]\d\d:?\d\d)?)?)");
  std::smatch match;
  if (!std::regex_match(text, match, pattern)) return parseTimeWords(text, now);
  std::tm time{};
  time.tm_year = number(match[1]) - 1900;
  time.tm_mon = number(match[2]) - 1;
  time.tm_mday = number(match[3]);
  time.tm_hour = number(match[4]);
  time.tm_min = number(match[5]);
  time.tm_sec = number(match[6]);
  time.tm_isdst = -1;
  const auto seconds = secondsOf(time, match[8].str());
  if (!seconds) return std::nullopt;
  return Stamp{*seconds * kSecond_ns + fraction_ns(match[7])};
}

std::string timeText(Stamp stamp) {
  std::time_t seconds = stamp.ns / kSecond_ns;
  std::int64_t rest_ns = stamp.ns % kSecond_ns;
  if (rest_ns < 0) {
    seconds -= 1;
    rest_ns += kSecond_ns;
  }
  return fmt::format("{}.{:03}Z", secondText(seconds), rest_ns / 1'000'000);
}

std::string dateNow() { return secondText(std::time(nullptr)) + "Z"; }

}  // namespace afterglow::replay
