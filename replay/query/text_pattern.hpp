/// \file
/// A regular expression of MongoDB's kind: Perl's, by the same library (PCRE2).
#pragma once

#include <memory>
#include <string>

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
  std::shared_ptr<const void> code_;
};

}  // namespace afterglow::replay
