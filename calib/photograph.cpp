#include "calib/photograph.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string_view>

namespace afterglow::calib {
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

bool isPhotograph(const std::string& path) {
  std::array<char, kMedicalAt + kMedical.size()> read{};
  std::ifstream file(path, std::ios::binary);
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
    if (isPhotograph(path)) image = cv::imread(path, flags);
  } catch (const cv::Exception&) {
    // A size that OpenCV refuses to allocate: reported below, as all unreadable files.
  }
  if (image.empty()) throw std::runtime_error(path + ": cannot be read as a picture");
  return image;
}

}  // namespace afterglow::calib
