/// \file
/// A sentence of a person, or of a speech recognizer, as words; and the questions that it may mean.
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

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

}  // namespace afterglow::replay
