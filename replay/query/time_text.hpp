/// \file
/// Times as people write them.
#pragma once

#include <optional>
#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// The times that parseTime() understands, for people.
constexpr const char* kTimesUnderstood =
    "a time is 2026-11-21T09:30:00Z (local without Z), seconds since the epoch, \"9:30\", \"today "
    "9:30\", \"yesterday 14:00\", \"last tuesday 8:15 pm\", \"10 minutes ago\" or \"now\"";

/// The wall clock.
Stamp wallNow();

/// "2026-11-21T09:30:00.25Z", with "+01:00" for Z, local time without either, but UTC in 1970,
/// where simulations are; seconds and time of
/// day may be left out. Or seconds since the epoch, "1396293887.84". Or in words, local time:
/// "now", "2h ago", "10 minutes ago", "9:30", "8pm", "today", "yesterday 14:00", "last tuesday
/// 8:15" (the latest one before today; without "last", today's too); a day alone is its first
/// second. Empty if it is none of these.
std::optional<Stamp> parseTime(const std::string& text, Stamp now = wallNow());

/// Local time with its offset, ISO 8601, to the millisecond: "2014-03-31T21:24:47.842+02:00"; "Z"
/// for no offset, and for times of 1970, which are a simulation's and of no zone. parseTime() reads
/// it.
std::string timeText(Stamp stamp);

/// The parts of timeText(): "2014-03-31", "21:24:47", and "+02:00" or "Z".
struct TimeParts {
  std::string day, clock, zone;
};
TimeParts timeParts(Stamp stamp);

/// Now in UTC, to the second, as files have it: "2026-11-21T04:30:00Z".
std::string dateNow();

}  // namespace afterglow::replay
