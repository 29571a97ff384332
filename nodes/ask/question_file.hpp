/// \file
/// Files of questions (assets/questions.yaml explains them); that one is built in.
#pragma once

#include <string>

#include "replay/ask/spoken_words.hpp"

namespace afterglow::nodes {

/// The file; "": the questions that are built in. Throws std::runtime_error "FILE:LINE: what is
/// wrong".
replay::QuestionBook readQuestions(const std::string& path);

/// The questions that are built in, by file name.
struct EmbeddedQuestions {
  const char* name;  ///< "questions.yaml"; nullptr ends the list
  const char* text;
};
extern const EmbeddedQuestions kEmbeddedQuestions[];

}  // namespace afterglow::nodes
