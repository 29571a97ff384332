#include "replay/query/time_text.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace afterglow::replay::time_text_test {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::optional<std::int64_t> nanoseconds(const std::string& text) {
  const auto stamp = parseTime(text);
  return stamp ? std::optional(stamp->ns) : std::nullopt;
}

TEST(ParseTime, takesSecondsSinceTheEpoch) {
  EXPECT_EQ(nanoseconds("0"), 0);
  EXPECT_EQ(nanoseconds("1396293887.844783943"), 1396293887844783943);
  EXPECT_EQ(nanoseconds("12.5"), 12 * kSecond_ns + 500'000'000);
}

TEST(ParseTime, takesIso8601) {
  EXPECT_EQ(nanoseconds("2014-03-31T19:24:47.844Z"), 1396293887844000000);
  EXPECT_EQ(nanoseconds("2014-03-31T21:24:47+02:00"), 1396293887 * kSecond_ns);
  EXPECT_EQ(nanoseconds("2014-03-31T13:54:47-0530"), 1396293887 * kSecond_ns);
  EXPECT_EQ(nanoseconds("2014-03-31 19:24Z"), 1396293840 * kSecond_ns);
}

TEST(ParseTime, takesLocalTimeWithoutAZone) {
  setenv("TZ", "XYZ-3", 1);  // POSIX's sign: three hours east
  tzset();
  EXPECT_EQ(nanoseconds("2014-03-31T22:24:47"), 1396293887 * kSecond_ns);
  EXPECT_EQ(nanoseconds("2014-03-31"), 1396213200 * kSecond_ns);
  EXPECT_EQ(nanoseconds("1970-01-01T00:02:03"), 123 * kSecond_ns) << "a simulation's";
  unsetenv("TZ");
  tzset();
}

TEST(ParseTime, refusesWhatIsNoTime) {
  for (const char* text :
       {"", "gestern", "25:00", "9:75", "13pm", "last", "ago", "ten ago", "2014-13-01",
        "2014-02-30", "2014-03-31T25:00Z", "2014-03-31T10:61Z", "2014-03-31T", "-5", "1e9",
        "12345678901", "2014-03-31T19:24:47.1234567890Z"}) {
    EXPECT_FALSE(parseTime(text)) << text;
  }
}

TEST(ParseTime, refusesWhatNanosecondsDoNotReach) {
  for (const char* text : {"9999999999", "9223372036", "2500-01-01Z", "9999-12-31T23:59:59Z",
                           "0000-01-01T00:00:00Z", "999999999 weeks ago"}) {
    EXPECT_FALSE(parseTime(text)) << text;
  }
  EXPECT_EQ(nanoseconds("2262-01-01T00:00:00Z"), 9214646400 * kSecond_ns);
}

TEST(ParseTime, refusesTextsOfAnyLength) {
  for (const char letter : {' ', '1', 'a'}) {
    EXPECT_FALSE(parseTime(std::string(60'000, letter) + "!")) << letter;
  }
}

/// Of a Wednesday, 2026-11-25 10:30 UTC.
std::string saidOnWednesday(const std::string& text) {
  setenv("TZ", "UTC", 1);
  tzset();
  const auto stamp = parseTime(text, *parseTime("2026-11-25T10:30:00Z"));
  unsetenv("TZ");
  tzset();
  return stamp ? timeText(*stamp).substr(0, 19) : "none";
}

TEST(ParseTime, takesWords) {
  EXPECT_EQ(saidOnWednesday("now"), "2026-11-25T10:30:00");
  EXPECT_EQ(saidOnWednesday("10 minutes ago"), "2026-11-25T10:20:00");
  EXPECT_EQ(saidOnWednesday("2h ago"), "2026-11-25T08:30:00");
  EXPECT_EQ(saidOnWednesday("an hour ago"), "2026-11-25T09:30:00");
  EXPECT_EQ(saidOnWednesday("1.5 days ago"), "2026-11-23T22:30:00");
  EXPECT_EQ(saidOnWednesday("today 9:30"), "2026-11-25T09:30:00");
  EXPECT_EQ(saidOnWednesday("9:30:15"), "2026-11-25T09:30:15");
  EXPECT_EQ(saidOnWednesday("Yesterday at 14:00"), "2026-11-24T14:00:00");
  EXPECT_EQ(saidOnWednesday("yesterday"), "2026-11-24T00:00:00");
  EXPECT_EQ(saidOnWednesday("yesterday 2pm"), "2026-11-24T14:00:00");
  EXPECT_EQ(saidOnWednesday("12:05 am"), "2026-11-25T00:05:00");
  EXPECT_EQ(saidOnWednesday("last tuesday 8:15"), "2026-11-24T08:15:00");
  EXPECT_EQ(saidOnWednesday("wednesday"), "2026-11-25T00:00:00");
  EXPECT_EQ(saidOnWednesday("last wednesday"), "2026-11-18T00:00:00");
  EXPECT_EQ(saidOnWednesday("thu 8:00"), "2026-11-19T08:00:00");
}

/// As a machine of this zone says it.
std::string textIn(const char* zone, Stamp stamp) {
  setenv("TZ", zone, 1);
  tzset();
  const std::string text = timeText(stamp);
  const bool is_read = parseTime(text) == Stamp{stamp.ns - (stamp.ns % 1'000'000 + 1'000'000) % 1'000'000};
  unsetenv("TZ");
  tzset();
  return is_read ? text : "not read: " + text;
}

TEST(TimeText, isLocalWithItsOffset) {
  const Stamp stamp{1396293887844783943}, winter{1385900000000000000};
  EXPECT_EQ(textIn("Europe/Berlin", stamp), "2014-03-31T21:24:47.844+02:00");
  EXPECT_EQ(textIn("Europe/Berlin", winter), "2013-12-01T13:13:20.000+01:00");
  EXPECT_EQ(textIn("America/St_Johns", stamp), "2014-03-31T16:54:47.844-02:30");
  EXPECT_EQ(textIn("Asia/Kathmandu", stamp), "2014-04-01T01:09:47.844+05:45");
  EXPECT_EQ(textIn("UTC", stamp), "2014-03-31T19:24:47.844Z");
}

TEST(TimeText, isUtcWhereASimulationsTimeBegins) {
  EXPECT_EQ(textIn("Europe/Berlin", Stamp{0}), "1970-01-01T00:00:00.000Z");
  EXPECT_EQ(timeText(Stamp{-1}), "1969-12-31T23:59:59.999Z");
}

}  // namespace
}  // namespace afterglow::replay::time_text_test
