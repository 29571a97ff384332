/// \file
/// Files that somebody names.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace afterglow::calib {

/// Opens a regular file. The stream has failed for anything else: a pipe would be waited for, a
/// device never ends.
inline std::ifstream openRegularFile(const std::string& path) {
  std::error_code error;
  const bool is_regular = std::filesystem::is_regular_file(path, error);
  return std::ifstream(is_regular ? path : "", std::ios::binary);
}

}  // namespace afterglow::calib
