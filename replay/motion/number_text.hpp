/// \file
/// A number within a sentence.
#pragma once

#include <cstdio>
#include <string>

namespace afterglow::replay {

/// In four digits at most: "10", "0.25".
inline std::string numberText(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.4g", value);
  return text;
}

}  // namespace afterglow::replay
