/// \file
/// Numbers in texts for people.
#pragma once

#include <string>

namespace afterglow::calib {

/// printf into a string of at most 511 characters. The format is a literal, never a user's text.
__attribute__((format(printf, 1, 2))) std::string formatted(const char* format, ...);

}  // namespace afterglow::calib
