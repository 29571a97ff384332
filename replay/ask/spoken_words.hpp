/// \file
/// A sentence of a person, or of a speech recognizer, as words.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "replay/ask/question_book.hpp"

namespace afterglow::replay {

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
