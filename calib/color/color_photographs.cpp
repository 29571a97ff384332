#include "calib/color/color_photographs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "calib/color/color.hpp"
#include "calib/color/color_files.hpp"
#include "calib/picture.hpp"

namespace afterglow::calib {
namespace {

namespace fs = std::filesystem;

constexpr double kLitShare = 0.5, kLeastLit = 0.01, kMostOverexposed = 0.005;
constexpr int kLeastSide = 16;

/// NN_rrggbb; empty: another file.
std::optional<Rgb> shownIn(const std::string& stem) {
  const auto isDigit = [](unsigned char c) { return std::isdigit(c) != 0; };
  const auto isHex = [](unsigned char c) { return std::isxdigit(c) != 0; };
  const std::size_t line = stem.find('_');
  const bool is_color = line != std::string::npos && line > 0 && stem.size() == line + 7 &&
                        std::all_of(stem.begin(), stem.begin() + int(line), isDigit) &&
                        std::all_of(stem.begin() + int(line) + 1, stem.end(), isHex);
  if (!is_color) return std::nullopt;
  const unsigned long value = std::stoul(stem.substr(line + 1), nullptr, 16);
  return Rgb{static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 8 & 0xff),
             static_cast<std::uint8_t>(value & 0xff)};
}

cv::Mat loadFirst(const std::vector<ColorFile>& files, const Rgb& color, const std::string& folder,
                  const std::string& name) {
  for (const ColorFile& file : files) {
    if (file.shown == color) return loadColors(file.path);
  }
  throw std::runtime_error(folder + ": holds no photograph of " + name +
                           " (NN_rrggbb.png, as `--pictures` wrote what to show)");
}

/// Returns the region where the projector's light falls, without its edge.
cv::Mat litRegion(const cv::Mat& black, const cv::Mat& white, const std::string& folder) {
  cv::Mat brighter;
  cv::transform(linear(white) - linear(black), brighter, cv::Matx13f(1, 1, 1));
  std::vector<float> values(brighter.begin<float>(), brighter.end<float>());
  const auto most = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), most, values.end());
  cv::Mat lit = brighter > kLitShare * *most;
  const int edge = 2 * std::max(1, black.cols / 200) + 1;
  cv::erode(lit, lit, cv::Mat::ones(edge, edge, CV_8U));
  if (*most < 0.005F || cv::countNonZero(lit) < kLeastLit * static_cast<double>(lit.total())) {
    throw std::runtime_error(
        folder + ": white is nowhere brighter than black: no projector's light is seen");
  }
  return lit;
}

ColorSample sampleOf(const ColorFile& file, const cv::Mat& lit) {
  const cv::Mat image = loadColors(file.path);
  if (image.size() != lit.size()) {
    throw std::runtime_error(file.path + ": is of another size than the photograph of black");
  }
  cv::Mat channels[3], clipped = cv::Mat::zeros(lit.size(), CV_8U);
  cv::split(image, channels);
  for (const cv::Mat& channel : channels) clipped |= channel > kBrightest;
  const double share = cv::countNonZero(clipped & lit) / double(cv::countNonZero(lit));
  if (share > kMostOverexposed) {
    throw std::runtime_error(
        fmt::format("{}: overexposed ({:.0f} % of what is lit): expose all photographs shorter",
                    file.path, 100 * share));
  }
  const cv::Scalar mean = cv::mean(linear(image), lit);
  return {file.shown, {mean[2], mean[1], mean[0]}};
}

}  // namespace

std::vector<ColorFile> colorFiles(const std::string& folder) {
  std::vector<ColorFile> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    std::string ending = entry.path().extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (ending != ".png" && ending != ".jpg" && ending != ".jpeg") continue;
    if (const auto shown = shownIn(entry.path().stem().string())) {
      files.push_back({entry.path().string(), *shown});
    }
  }
  if (error) throw std::runtime_error(folder + ": cannot be read");
  std::sort(files.begin(), files.end(),
            [](const ColorFile& a, const ColorFile& b) { return a.path < b.path; });
  return files;
}

cv::Mat loadColors(const std::string& path) {
  cv::Mat image = readPhotograph(path, cv::IMREAD_COLOR);
  if (image.cols < kLeastSide || image.rows < kLeastSide) {
    throw std::runtime_error(path + ": too few pixels");
  }
  return image;
}

cv::Mat linear(const cv::Mat& image) {
  cv::Mat table(1, 256, CV_32F), light;
  for (int i = 0; i < 256; ++i) table.at<float>(i) = static_cast<float>(lightOfSrgb(i / 255.0));
  cv::LUT(image, table, light);
  return light;
}

std::size_t writeColorPictures(const std::string& folder, int width, int height) {
  const std::vector<Rgb> colors = colorsToShow();
  std::error_code ignored;
  fs::create_directories(folder, ignored);
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const Rgb& color = colors[i];
    const cv::Mat picture(height, width, CV_8UC3, cv::Scalar(color[2], color[1], color[0]));
    const std::string name =
        fmt::format("{:02}_{:02x}{:02x}{:02x}.png", i, color[0], color[1], color[2]);
    const std::string path = (fs::path(folder) / name).string();
    bool is_written = false;
    try {
      is_written = cv::imwrite(path, picture);
    } catch (const cv::Exception&) {
      // No memory, or no folder: reported below.
    }
    if (!is_written) throw std::runtime_error(path + ": the picture cannot be written");
  }
  return colors.size();
}

std::vector<ColorSample> readColorPhotographs(const std::string& folder) {
  const std::vector<ColorFile> files = colorFiles(folder);
  const cv::Mat black = loadFirst(files, {0, 0, 0}, folder, "black");
  const cv::Mat white = loadFirst(files, {255, 255, 255}, folder, "white");
  if (black.size() != white.size()) {
    throw std::runtime_error(folder + ": the photographs are of different sizes");
  }
  const cv::Mat lit = litRegion(black, white, folder);
  std::vector<ColorSample> samples;
  for (const ColorFile& file : files) samples.push_back(sampleOf(file, lit));
  return samples;
}

}  // namespace afterglow::calib
