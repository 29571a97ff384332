/// \file
/// The times in a question: "yesterday", "this morning", "an hour ago", "the second time", "before
/// that".
#pragma once

#include <optional>
#include <string>

#include "replay/ask/spoken_words.hpp"
#include "replay/messages/message.hpp"

namespace afterglow::replay {

struct SpokenTime {
  enum class Which { Newest, Last, FromOldest, Before, After };

  Which which = Which::Newest;           ///< Last: somebody said so; Before, After: the last answer
  std::size_t count = 0;                 ///< FromOldest: 0 is the first one
  std::optional<Stamp> since, until;     ///< wall clock, [since, until)
  std::string text;                      ///< the words that said it; empty: none did
  bool isGiven() const { return !text.empty(); }
};

/// Takes the words that say a time out of `words`. Days are those of this machine's time zone.
SpokenTime takeTime(SpokenWords& words, Stamp now);

}  // namespace afterglow::replay
