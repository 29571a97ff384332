#include "calib/picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <vector>

#include "calib/photograph.hpp"

namespace afterglow::calib {
namespace {

/// The place of chunks that must precede the pixels: after the signature (8 bytes) and IHDR (25).
constexpr std::size_t kAfterHeader = 33;

std::string bigEndian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>((value >> shift) & 0xff);
  return bytes;
}

/// PNG specification, annex D.
std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = 0xffffffffu;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xedb88320u : 0);
  }
  return ~crc;
}

/// pHYs, 11.3.5.3 of the PNG specification. OpenCV cannot write it.
std::string physicalSizeChunk(double pixels_per_m_x, double pixels_per_m_y) {
  const std::string body = "pHYs" +
                           bigEndian(static_cast<std::uint32_t>(std::lround(pixels_per_m_x))) +
                           bigEndian(static_cast<std::uint32_t>(std::lround(pixels_per_m_y))) +
                           '\1';  // the unit: meters
  return bigEndian(static_cast<std::uint32_t>(body.size() - 4)) + body + bigEndian(crc32(body));
}

/// OpenCV's header wants a mutable pointer; it is only read.
cv::Mat asMat(const Picture& picture) {
  return cv::Mat(picture.height, picture.width, CV_8UC1,
                 const_cast<std::uint8_t*>(picture.pixels.data()));
}

}  // namespace

Picture loadPicture(const std::string& path) {
  const cv::Mat image = readPhotograph(path, cv::IMREAD_GRAYSCALE);
  if (image.cols < 16 || image.rows < 16) {
    throw std::runtime_error(path + ": " + std::to_string(image.cols) + " x " +
                             std::to_string(image.rows) + " pixels are too few for tags");
  }
  return {image.cols, image.rows, {image.datastart, image.dataend}};
}

void savePicture(const std::string& path, const Picture& picture) {
  bool is_written = false;
  try {
    is_written = cv::imwrite(path, asMat(picture));
  } catch (const cv::Exception&) {
    // An ending OpenCV does not know.
  }
  if (!is_written) throw std::runtime_error(path + ": the picture cannot be written");
}

std::string encodePng(const Picture& picture, const Eigen::Vector2d& size_m) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".png", asMat(picture), bytes) || bytes.size() < kAfterHeader) {
    throw std::runtime_error("a picture of " + std::to_string(picture.width) + " x " +
                             std::to_string(picture.height) + " pixels cannot be written as PNG");
  }
  std::string png(bytes.begin(), bytes.end());
  if (size_m.minCoeff() > 0) {
    png.insert(kAfterHeader,
               physicalSizeChunk(picture.width / size_m.x(), picture.height / size_m.y()));
  }
  return png;
}

std::vector<std::uint8_t> jpegOf(const Picture& picture, int widest) {
  cv::Mat image = asMat(picture);
  if (picture.width > widest) {
    const int height = std::max(1, picture.height * widest / picture.width);
    cv::Mat small;
    cv::resize(image, small, cv::Size(widest, height), 0, 0, cv::INTER_AREA);
    image = small;
  }
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 80});
  return bytes;
}

}  // namespace afterglow::calib
