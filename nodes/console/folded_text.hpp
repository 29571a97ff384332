/// \file
/// Text as a search compares it.
#pragma once

#include <string>
#include <vector>

namespace afterglow::nodes {

/// In small letters and without accents, as far as Latin, Greek and Cyrillic go. Bytes that are no
/// UTF-8 are left out.
std::string foldedText(const std::string& text);

/// What blanks separate; "quoted words" are one.
std::vector<std::string> searchWords(const std::string& text);

}  // namespace afterglow::nodes
