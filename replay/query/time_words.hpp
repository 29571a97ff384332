/// \file
/// Times in words: "yesterday 14:00", "10 minutes ago". Internal to replay.
#pragma once

#include <optional>
#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// As parseTime() takes them, seen from `now`; empty for other words.
std::optional<Stamp> parseTimeWords(const std::string& text, Stamp now);

}  // namespace afterglow::replay
