/// \file
/// Regular expressions that somebody else wrote, on text that somebody else wrote: Perl's (PCRE2),
/// with an end to the work that one match may take. std::regex has none: it crashes on long texts
/// and tries nested repetitions for ever. Knows nothing else of this program.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace afterglow::replay {

/// Any thread.
class RegularExpression {
 public:
  /// A match that takes too long, as nested repetitions do; what() names the expression.
  struct TooLong : std::invalid_argument {
    using std::invalid_argument::invalid_argument;
  };

  /// `letters`: i (case aside), m (^ and $ at every line), s (. takes line breaks), x (blanks are
  /// not part of it); others are ignored. Throws std::invalid_argument, "at character N: REASON".
  explicit RegularExpression(const std::string& pattern, const std::string& letters = "");
  /// Makes an expression for the whole names of topics or nodes. Throws std::invalid_argument, one
  /// line that quotes it.
  static RegularExpression ofNames(const std::string& pattern);

  /// True if the text has a match. Throws TooLong.
  bool isIn(const std::string& text) const;
  /// True if the text as a whole is a match. Throws TooLong.
  bool isWhole(const std::string& text) const;
  /// The groups of the whole text as a match, from 1 on, empty for those without a part in it; the
  /// text itself stands first. Nothing at all if it is no match. Throws TooLong.
  std::vector<std::string> groups(const std::string& text) const;

 private:
  std::string pattern_;
  std::shared_ptr<const void> code_;
};

}  // namespace afterglow::replay
