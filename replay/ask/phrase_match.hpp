/// \file
/// The fit of a sentence to the phrasings of questions.
#pragma once

#include <string>
#include <vector>

#include "replay/ask/spoken_words.hpp"

namespace afterglow::replay {

struct PhraseMatch {
  std::size_t question = 0;  ///< place in the book
  std::string phrasing;
  /// 0 to 1: the share of both sentences' words that are the same (Dice), by weight: words that
  /// ask ("why", "where") and "not" count twice, "the", "you", "it" a quarter.
  double score = 0;
  SpokenWords slot;       ///< the name that the person gave; empty: the phrasing has no slot
  bool is_sure = true;    ///< no word is left over, and none was guessed
  bool is_exact = true;   ///< true: every word was heard as it is written
};

/// The best phrasing of each question that has anything in common with the words, best first.
/// `words` are plainWords(), without times. None for what is no question.
std::vector<PhraseMatch> matchPhrases(const QuestionBook& book, const SpokenWords& words);

/// Returns true if they ask: an order ("pick up the cup") is no question.
bool isQuestion(const SpokenWords& words);

/// Returns true for "what", "why", "where" and their kin.
bool isAsking(const std::string& word);

/// Returns true if a word says something by itself: not "the", "you", "it".
bool isTelling(const std::string& word);

}  // namespace afterglow::replay
