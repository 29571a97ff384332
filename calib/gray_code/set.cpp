#include "calib/gray_code/set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <stdexcept>

namespace afterglow::calib {
namespace {

namespace fs = std::filesystem;

constexpr int kLargestStep = 64;

bool isPhotograph(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& one : extension) {
    one = static_cast<char>(std::tolower(static_cast<unsigned char>(one)));
  }
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg" ||
         extension == ".bmp" || extension == ".tif" || extension == ".tiff";
}

/// The number at the end of a name; empty if there is none.
std::optional<int> numberOf(const fs::path& path) {
  const std::string stem = path.stem().string();
  const std::size_t end = stem.find_last_not_of("0123456789");
  const std::string digits = end == std::string::npos ? stem : stem.substr(end + 1);
  if (digits.empty() || digits.size() > 6) return std::nullopt;
  return std::stoi(digits);
}

bool beginsWith(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

/// Numbered pictures without gaps. Empty if the folder holds none.
std::vector<std::string> numberedPictures(const fs::path& folder, const std::string& prefix) {
  std::map<int, std::string> by_number;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    const auto number = numberOf(path);
    if (!number || !isPhotograph(path) || !beginsWith(path.filename().string(), prefix)) continue;
    const auto added = by_number.emplace(*number, path.string());
    if (!added.second) {
      throw std::runtime_error(fmt::format("{}: two pictures have the number {}: {} and {}",
                                           folder.string(), *number, added.first->second,
                                           path.string()));
    }
  }
  std::vector<std::string> paths;
  for (const auto& [number, path] : by_number) {
    if (!paths.empty() && by_number.count(number - 1) == 0) {
      throw std::runtime_error(
          fmt::format("{}: picture number {} is missing", folder.string(), number - 1));
    }
    paths.push_back(path);
  }
  return paths;
}

int bitsFor(int codes) {
  int bits = 0;
  while ((1 << bits) < codes) ++bits;
  return bits;
}

GrayAxis kaminoAxis(int pixels, int step) {
  return {pixels, bitsFor((pixels - 1) / step + 1), step, 0};
}

/// `bits`: how many of the axis's own are shown, the highest ones.
GrayAxis brownAxis(int pixels, int bits) {
  const int all = bitsFor(pixels);
  return {pixels, bits, 1 << (all - bits), ((1 << all) - pixels) / 2};
}

}  // namespace

std::vector<GrayCodeFiles> findGrayCode(const std::string& folder) {
  if (!fs::is_directory(folder)) throw std::runtime_error(folder + ": no such folder");
  std::vector<GrayCodeFiles> all;
  std::vector<fs::path> poses;
  bool is_kamino = false;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (!entry.is_directory()) continue;
    poses.push_back(entry.path());
    is_kamino = is_kamino || beginsWith(entry.path().filename().string(), "capture_");
  }
  std::sort(poses.begin(), poses.end());
  for (const fs::path& pose : poses) {
    const std::string name = pose.filename().string();
    if (is_kamino && !beginsWith(name, "capture_")) continue;
    GrayCodeFiles files{name, is_kamino ? GrayCodeLayout::Kamino : GrayCodeLayout::Brown,
                        numberedPictures(pose, is_kamino ? "graycode_" : "")};
    if (!files.paths.empty()) all.push_back(files);
  }
  if (all.empty()) {
    throw std::runtime_error(folder +
                             ": holds no capture_*/graycode_NN.png and no POSE/cam_NN.png");
  }
  return all;
}

std::optional<double> GrayAxis::middle(int code) const {
  const double at = double(code) * step + 0.5 * (step - 1) - offset;
  if (at < -0.5 * step || at > pixels - 1 + 0.5 * step) return std::nullopt;
  return at;
}

GrayCode grayCodeOf(GrayCodeLayout layout, std::size_t pictures, int width, int height, int step) {
  std::string steps;  // that would fit
  if (layout == GrayCodeLayout::Brown) {
    const int bits = pictures >= 6 && pictures % 4 == 2 ? static_cast<int>(pictures - 2) / 4 : 0;
    if (bits > 0 && bits <= std::min(bitsFor(width), bitsFor(height))) {
      return {layout, brownAxis(width, bits), brownAxis(height, bits)};
    }
  } else {
    for (int one = 1; one <= kLargestStep; ++one) {
      const GrayCode code{layout, kaminoAxis(width, one), kaminoAxis(height, one)};
      if (code.pictures() != pictures) continue;
      if (one == step) return code;
      steps += (steps.empty() ? "; or were they made with --code-step " : ", ") +
               std::to_string(one);
    }
  }
  throw std::invalid_argument(
      fmt::format("{} pictures are no Gray code for a projector of {} x {} px in steps of {} px: "
                  "is a picture missing, or --projector not its resolution{}?",
                  pictures, width, height, step, steps));
}

namespace {

/// Below this, in gray levels between black and white, noise decides.
constexpr int kLeastContrast = 8;
/// A stripe's and its inverse's difference, as a share of white less black: less is an edge.
constexpr double kLeastShare = 0.15;
constexpr int kLeastDifference = 3;

int fromGray(int gray) {
  for (int shift = 1; shift < 32; shift <<= 1) gray ^= gray >> shift;
  return gray;
}

constexpr float kUnlit = std::numeric_limits<float>::quiet_NaN();
constexpr float kOutside = std::numeric_limits<float>::infinity();

/// Decodes one axis at one pixel. `first`: its first pair of pictures.
float decodeAxis(const std::vector<Picture>& pictures, std::size_t first, const GrayAxis& axis,
                 std::size_t pixel, int contrast) {
  const int limit = std::max(kLeastDifference, static_cast<int>(kLeastShare * contrast));
  int gray = 0, unsure = 0, unsure_bit = 0;
  for (int bit = axis.bits - 1; bit >= 0; --bit) {
    const std::size_t pair = first + 2 * std::size_t(axis.bits - 1 - bit);
    const int difference =
        int(pictures[pair].pixels[pixel]) - int(pictures[pair + 1].pixels[pixel]);
    if (difference > 0) gray |= 1 << bit;
    if (std::abs(difference) >= limit) continue;
    ++unsure;
    unsure_bit = bit;
  }
  if (unsure > 1) return kUnlit;
  const auto one = axis.middle(fromGray(gray));
  if (unsure == 0) return one ? static_cast<float>(*one) : kOutside;
  const auto other = axis.middle(fromGray(gray ^ (1 << unsure_bit)));
  // Codes beside each other differ in one bit: any other two are a misreading.
  if (!one || !other || std::abs(*one - *other) > 1.01 * axis.step) return kUnlit;
  return static_cast<float>(0.5 * (*one + *other));
}

}  // namespace

DecodedLight decode(const std::vector<Picture>& pictures, const GrayCode& code) {
  const Picture& white = pictures[code.white()];
  const Picture& black = pictures[code.white() + 1];
  const std::size_t columns = code.stripes();
  const std::size_t rows = columns + 2 * std::size_t(code.across.bits);
  DecodedLight light{white.width, white.height, {}};
  light.projector_px.resize(white.pixels.size(), Eigen::Vector2f(kUnlit, kUnlit));
  for (std::size_t i = 0; i < white.pixels.size(); ++i) {
    const int contrast = int(white.pixels[i]) - int(black.pixels[i]);
    if (contrast < kLeastContrast) continue;
    const float x = decodeAxis(pictures, columns, code.across, i, contrast);
    if (std::isnan(x)) continue;
    const float y = decodeAxis(pictures, rows, code.down, i, contrast);
    if (!std::isnan(y)) light.projector_px[i] = Eigen::Vector2f(x, y);
  }
  return light;
}

}  // namespace afterglow::calib
