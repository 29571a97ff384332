/// \file
/// Times as people write them.
#pragma once

#include <optional>
#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// "2026-11-21T09:30:00.25Z", with "+01:00" for Z, local time without either; seconds and time of
/// day may be left out. Or seconds since the epoch, "1396293887.84". Empty if it is neither.
std::optional<replay::Stamp> parseTime(const std::string& text);

/// UTC, ISO 8601, to the millisecond: "2014-03-31T19:24:47.842Z".
std::string timeText(replay::Stamp stamp);

}  // namespace afterglow::nodes
