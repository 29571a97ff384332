#include "nodes/verbs/time_text.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace afterglow::nodes {
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
  unsetenv("TZ");
  tzset();
}

TEST(ParseTime, refusesWhatIsNoTime) {
  for (const char* text :
       {"", "yesterday", "2014-13-01", "2014-02-30", "2014-03-31T25:00Z", "2014-03-31T10:61Z",
        "2014-03-31T", "-5", "1e9", "12345678901", "2014-03-31T19:24:47.1234567890Z"}) {
    EXPECT_FALSE(parseTime(text)) << text;
  }
}

TEST(TimeText, saysTheTimeInUtc) {
  EXPECT_EQ(timeText(replay::Stamp{1396293887844783943}), "2014-03-31T19:24:47.844Z");
  EXPECT_EQ(timeText(replay::Stamp{0}), "1970-01-01T00:00:00.000Z");
  EXPECT_EQ(timeText(replay::Stamp{-1}), "1969-12-31T23:59:59.999Z");
}

}  // namespace
}  // namespace afterglow::nodes
