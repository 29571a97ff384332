/// \file
/// A photograph in grey.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace afterglow::calib {

/// Row-major, no padding; encoded (gamma) grey levels as a camera writes them.
struct Picture {
  int width = 0, height = 0;  ///< px
  std::vector<std::uint8_t> pixels;

  std::uint8_t at(int x, int y) const {
    return pixels[std::size_t(y) * std::size_t(width) + std::size_t(x)];
  }
};

/// PNG, JPEG and whatever OpenCV reads; colour becomes grey. Throws std::runtime_error naming the
/// file if it cannot be read or is smaller than 16 px a side.
Picture loadPicture(const std::string& path);

/// Throws std::runtime_error naming the file if it cannot be written.
void savePicture(const std::string& path, const Picture& picture);

}  // namespace afterglow::calib
