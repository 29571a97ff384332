#include "calib/picture.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calib/file_replacement.hpp"

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

namespace {

using namespace std::string_view_literals;

/// DICOM has no beginning: it is known by what follows 128 bytes, of which others may make use.
constexpr std::size_t kMedicalAt = 128;
constexpr auto kMedical = "DICM"sv;
constexpr std::array kBeginnings{"\x89PNG\r\n\x1a\n"sv, "\xff\xd8\xff"sv, "BM"sv,
                                 "II*\0"sv, "MM\0*"sv};

/// OpenCV looks further where it does not like the first chunk, as far as DICOM.
bool isWebp(std::string_view begun) {
  return begun.size() > kMedicalAt && begun.substr(0, 4) == "RIFF" &&
         begun.substr(8, 4) == "WEBP" && begun.substr(kMedicalAt) != kMedical;
}

/// P1 to P6 and white space: Netpbm's.
bool isPnm(std::string_view begun) {
  return begun.size() > 2 && begun[0] == 'P' && begun[1] >= '1' && begun[1] <= '6' &&
         " \t\r\n"sv.find(begun[2]) != std::string_view::npos;
}

// ----------------------------------------------------------------------- sizes, before decoding
std::uint64_t number(std::string_view bytes, std::size_t at, std::size_t count, bool big_endian) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count && at + count <= bytes.size(); ++i) {
    const auto byte = static_cast<unsigned char>(bytes[at + (big_endian ? i : count - 1 - i)]);
    value = (value << 8) | byte;
  }
  return value;
}

struct Size {
  std::uint64_t width = 0, height = 0;
};

/// Reads the frame header (SOF), which is among the segments that begin the file.
Size sizeOfJpeg(std::string_view file) {
  for (std::size_t at = 2; at + 9 < file.size() && file[at] == '\xff';) {
    const auto marker = static_cast<unsigned char>(file[at + 1]);
    const bool is_frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 &&
                          marker != 0xcc;
    if (is_frame) return {number(file, at + 7, 2, true), number(file, at + 5, 2, true)};
    at += marker == 0xff ? 1 : 2 + number(file, at + 2, 2, true);
  }
  return {};
}

/// Returns up to `count` bytes from this place on.
std::string read(std::istream& file, std::uint64_t at, std::size_t count) {
  std::string bytes(count, '\0');
  file.clear();
  file.seekg(static_cast<std::streamoff>(at));
  file.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

/// Reads tags 256 and 257 of the first directory, which may lie anywhere in the file.
Size sizeOfTiff(std::string_view begun, std::istream& file) {
  constexpr std::size_t kLongest = 2 + 12 * 65535;
  const bool big = begun[0] == 'M';
  const std::string directory = read(file, number(begun, 4, 4, big), kLongest);
  Size size;
  for (std::size_t i = 0; i < number(directory, 0, 2, big); ++i) {
    const std::size_t at = 2 + 12 * i;
    const std::size_t bytes = number(directory, at + 2, 2, big) == 3 ? 2 : 4;
    const std::uint64_t tag = number(directory, at, 2, big);
    const std::uint64_t value = number(directory, at + 8, bytes, big);
    if (tag == 256) size.width = value;
    if (tag == 257) size.height = value;
  }
  return size;
}

/// Reads the two numbers behind "P5 "; comments reach to the end of their lines.
Size sizeOfPnm(std::string_view file) {
  std::array<std::uint64_t, 2> numbers{};
  std::size_t at = 2;
  for (std::uint64_t& value : numbers) {
    while (at < file.size() && (std::isspace(static_cast<unsigned char>(file[at])) != 0 ||
                                file[at] == '#')) {
      at = file[at] == '#' ? std::min(file.find('\n', at), file.size()) : at + 1;
    }
    while (at < file.size() && std::isdigit(static_cast<unsigned char>(file[at])) != 0 &&
           value < 1'000'000'000) {
      value = 10 * value + static_cast<std::uint64_t>(file[at++] - '0');
    }
  }
  return {numbers[0], numbers[1]};
}

/// Returns the size that the header tells, whatever follows; 0 for WebP, whose sides end at 16383
/// px, and for a file without a header.
Size sizeOf(std::istream& source) {
  constexpr std::size_t kHead = std::size_t{1} << 20;  // a JPEG's thumbnails come first
  const std::string head = read(source, 0, kHead);
  const std::string_view file = head;
  if (file.substr(0, 4) == "\x89PNG"sv) return {number(file, 16, 4, true), number(file, 20, 4, true)};
  if (file.substr(0, 2) == "\xff\xd8"sv) return sizeOfJpeg(file);
  if (file.substr(0, 2) == "II"sv || file.substr(0, 2) == "MM"sv) {
    return sizeOfTiff(file, source);
  }
  if (file.substr(0, 2) == "BM"sv) {
    const auto side = [&](std::size_t at) {
      return static_cast<std::uint64_t>(
          std::abs(std::int64_t{static_cast<std::int32_t>(number(file, at, 4, false))}));
    };
    return {side(18), side(22)};
  }
  return file.substr(0, 1) == "P"sv ? sizeOfPnm(file) : Size();
}

/// More pixels take more than 1 GB while they are decoded.
constexpr std::uint64_t kMostPixels = 128'000'000;

void requireSize(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const Size size = sizeOf(file);
  if (size.height == 0 || size.width <= kMostPixels / size.height) return;
  throw std::runtime_error(path + ": a picture of " + std::to_string(size.width) + " x " +
                           std::to_string(size.height) + " pixels: at most 128 million are read");
}

bool isPhotograph(const std::string& path) {
  std::array<char, kMedicalAt + kMedical.size()> read{};
  std::ifstream file = openRegularFile(path);
  file.read(read.data(), read.size());
  const std::string_view begun(read.data(), static_cast<std::size_t>(file.gcount()));
  return isPnm(begun) || isWebp(begun) ||
         std::any_of(kBeginnings.begin(), kBeginnings.end(), [&](auto beginning) {
           return begun.substr(0, beginning.size()) == beginning;
         });
}

}  // namespace

cv::Mat readPhotograph(const std::string& path, int flags) {
  cv::Mat image;
  try {
    if (isPhotograph(path)) {
      requireSize(path);
      image = cv::imread(path, flags);
    }
  } catch (const cv::Exception&) {
    // A size that OpenCV refuses to allocate: reported below, as all unreadable files.
  }
  if (image.empty()) throw std::runtime_error(path + ": cannot be read as a picture");
  return image;
}

}  // namespace afterglow::calib
