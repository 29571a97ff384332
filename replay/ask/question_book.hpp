/// \file
/// Questions of people, as values: phrasings and the behaviors that answer. Files of it are read by
/// nodes/ask/question_file.hpp.
#pragma once

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
  std::vector<std::string> phrasings;  ///< phrasings with at most one slot each: "what did you
                                       ///< pick", "where is {object}"
  bool may_move = false;               ///< else light and speech, even where the player allows more
  bool in_words = false;               ///< told, not shown
};

struct QuestionBook {
  std::vector<Question> questions;
  std::map<std::string, std::string> synonyms;  ///< "grabbed" -> "pick", "how come" -> "why"
  std::set<std::string> fillers;
};

}  // namespace afterglow::replay
