/// \file
/// What somebody may have meant: the known word nearest to an unknown one.
#pragma once

#include <string>
#include <vector>

namespace afterglow::replay {

/// The word of `known` with the fewest letters inserted, dropped or changed (Levenshtein, Soviet
/// Physics Doklady 1966), capitals aside; empty if none is near.
std::string nearestWord(const std::string& word, const std::vector<std::string>& known);

/// "; did you mean WORD?", or nothing.
std::string didYouMean(const std::string& word, const std::vector<std::string>& known);

}  // namespace afterglow::replay
