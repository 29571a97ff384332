/// \file
/// A gray image: a photograph, a board or a pattern.
///
/// The steps between a camera's file and OpenCV.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace cv {
class Mat;
}

namespace afterglow::calib {

/// Row-major, no padding; gamma-encoded gray levels, as cameras write them.
struct Picture {
  int width = 0, height = 0;  ///< px
  std::vector<std::uint8_t> pixels;

  std::uint8_t at(int x, int y) const {
    return pixels[std::size_t(y) * std::size_t(width) + std::size_t(x)];
  }
};

/// PNG, JPEG, WebP, BMP, PNM or TIFF; color becomes gray. Throws std::runtime_error naming the
/// file if it cannot be read or is smaller than 16 px a side.
Picture loadPicture(const std::string& path);

/// Throws std::runtime_error naming the file if it cannot be written.
void savePicture(const std::string& path, const Picture& picture);

/// A PNG of 8 bit gray, no alpha. With a size the file says how many pixels a meter has, so that
/// printing programs get it right. Throws std::runtime_error if it cannot be encoded.
std::string encodePng(const Picture& picture,
                      const Eigen::Vector2d& size_m = Eigen::Vector2d::Zero());

/// Encodes the picture as a JPEG file, at most `widest` pixels wide.
std::vector<std::uint8_t> jpegOf(const Picture& picture, int widest);

/// The pixels of a file that begins as PNG, JPEG, WebP, BMP, PNM or TIFF do, whatever its name;
/// `flags` are those of cv::imread. OpenCV as Debian builds it hands all else to libraries for maps
/// and medical pictures (GDAL, GDCM), and GDCM ends the process over a file that is cut short.
/// Throws std::runtime_error naming the file if it is none of these, cannot be decoded, or has more
/// than 128 million pixels by its header.
cv::Mat readPhotograph(const std::string& path, int flags);

}  // namespace afterglow::calib
