/// \file
/// The photographs of colors in a folder, as linear light.
#pragma once

#include <string>
#include <vector>

#include "calib/color/color.hpp"

namespace cv {
class Mat;
}

namespace afterglow::calib {

/// Beyond this value, of 255, a camera clips.
constexpr int kBrightest = 250;

struct ColorFile {
  std::string path;
  Rgb shown;
};

/// The files NN_rrggbb.png or .jpg of a folder, in the order of their names; others are passed
/// over. Throws std::runtime_error naming the folder: it cannot be read.
std::vector<ColorFile> colorFiles(const std::string& folder);

/// A photograph, 8 bits, blue first. Throws std::runtime_error naming the file: unreadable, or
/// smaller than 16 pixels.
cv::Mat loadColors(const std::string& path);

/// The linear light of such a photograph, as floats.
cv::Mat linear(const cv::Mat& image);

}  // namespace afterglow::calib
