/// \file
/// A sentence of a person, or of a speech recognizer, as words; and the questions that it may mean.
///
/// The times in a question: "yesterday", "this morning", "an hour ago", "the second time", "before
/// that".
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// The behavior of a question that any behavior may answer, by its time alone.
constexpr const char* kAnyBehavior = "*";
/// Words in a phrasing that stand for what the person names.
constexpr const char* kSlot = "{object}";

struct Question {
  std::string behavior;                ///< name of the behavior, or kAnyBehavior
  std::vector<std::string> phrasings;  ///< phrasings with a slot at most: "where is {object}"
  bool may_move = false;               ///< else light and speech, even where the player allows more
  bool in_words = false;               ///< told, not shown
};

struct QuestionBook {
  std::vector<Question> questions;
  std::map<std::string, std::string> synonyms;  ///< "grabbed" -> "pick", "how come" -> "why"
  std::set<std::string> fillers;
};

using SpokenWords = std::vector<std::string>;

/// Longer texts are no question.
constexpr std::size_t kLongestQuestion = 500;  // bytes

/// Returns the words in small letters, without punctuation; "didn't" is two words, "did not", and
/// "9:30" is one. Bytes of other alphabets are letters, control characters separate words. Empty
/// for a text longer than kLongestQuestion.
SpokenWords spokenWords(const std::string& text);

/// Returns the words without fillers, each synonym replaced.
SpokenWords plainWords(const SpokenWords& words, const QuestionBook& book);

/// Joins the words with blanks, as a text.
std::string joined(const SpokenWords& words);

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
