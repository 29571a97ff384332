/// \file
/// The known word that is most like an unknown one, for error messages.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "replay/messages/text.hpp"

namespace afterglow::replay {

/// Returns how many letters have to be inserted, dropped or changed to make one word of the other
/// (Levenshtein, Soviet Physics Doklady 1966), capitals aside.
std::size_t editDistance(const std::string& one, const std::string& other);

/// The word of `known` at the least distance; empty if none is near.
std::string nearestWord(const std::string& word, const std::vector<std::string>& known);

/// "; did you mean WORD?", or nothing.
std::string didYouMean(const std::string& word, const std::vector<std::string>& known);

}  // namespace afterglow::replay
