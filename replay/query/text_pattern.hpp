/// \file
/// The $regex of a filter: Perl's, by the library that MongoDB has, too (PCRE2).
#pragma once

#include <string>

#include "replay/query/regular_expression.hpp"

namespace afterglow::replay {

class TextPattern {
 public:
  /// `options`: i (case aside), m (^ and $ at every line), s (. takes line breaks), x (blanks are
  /// not part of it). Throws FilterError, with the place in the pattern.
  TextPattern(const std::string& pattern, const std::string& options);

  /// True if the text has a match. Throws FilterError for a pattern that takes too long, as nested
  /// repetitions do.
  bool isIn(const std::string& text) const;

 private:
  std::string pattern_;
  RegularExpression expression_;
};

}  // namespace afterglow::replay
