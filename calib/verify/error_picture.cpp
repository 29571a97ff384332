#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "calib/number_text.hpp"
#include "calib/verify/throw_picture.hpp"

namespace afterglow::calib {
namespace {

constexpr double kArrowScale = 10;
constexpr int kSubPixelBits = 4;
const cv::Scalar kGreen(60, 200, 60), kRed(60, 60, 240), kDarkEdge(20, 20, 20);

cv::Point fixedPoint(const Eigen::Vector2d& pixel) {
  return {static_cast<int>(std::lround(pixel.x() * (1 << kSubPixelBits))),
          static_cast<int>(std::lround(pixel.y() * (1 << kSubPixelBits)))};
}

void drawOutline(cv::Mat& image, const std::array<Eigen::Vector2d, 4>& corners,
                 const cv::Scalar& color) {
  for (std::size_t i = 0; i < 4; ++i) {
    cv::line(image, fixedPoint(corners[i]), fixedPoint(corners[(i + 1) % 4]), color, 1, cv::LINE_AA,
             kSubPixelBits);
  }
}

void drawLabel(cv::Mat& image, const std::string& text, const Eigen::Vector2d& at) {
  const cv::Point place(static_cast<int>(at.x()), static_cast<int>(at.y()) - 6);
  cv::putText(image, text, place, cv::FONT_HERSHEY_SIMPLEX, 0.5, kDarkEdge, 4, cv::LINE_AA);
  cv::putText(image, text, place, cv::FONT_HERSHEY_SIMPLEX, 0.5, {255, 255, 255}, 1, cv::LINE_AA);
}

void drawTarget(cv::Mat& image, const TargetCheck& target) {
  drawOutline(image, target.wanted_px, kGreen);
  const std::string name = std::to_string(target.id) + ": ";
  if (!target.is_seen) {
    drawLabel(image, name + "not seen", target.wanted_px[0]);
    return;
  }
  drawOutline(image, target.corners_px, kRed);
  Tag wanted, seen;
  wanted.corners = target.wanted_px;
  seen.corners = target.corners_px;
  const Eigen::Vector2d from = middleOf(wanted);
  const Eigen::Vector2d to = from + kArrowScale * (middleOf(seen) - from);
  cv::arrowedLine(image, fixedPoint(from), fixedPoint(to), kRed, 2, cv::LINE_AA, kSubPixelBits);
  drawLabel(image, name + fixedText(target.offset_mm.norm(), 1) + " mm", target.wanted_px[0]);
}

}  // namespace

void saveErrorPicture(const std::string& path, const Picture& photograph, const ThrowCheck& check) {
  const cv::Mat grey(photograph.height, photograph.width, CV_8U,
                     const_cast<std::uint8_t*>(photograph.pixels.data()));
  cv::Mat image;
  cv::cvtColor(grey, image, cv::COLOR_GRAY2BGR);
  for (const TargetCheck& target : check.targets) drawTarget(image, target);
  bool is_written = false;
  try {
    is_written = cv::imwrite(path, image);
  } catch (const cv::Exception&) {  // an ending it has no format for
  }
  if (!is_written) throw std::runtime_error(path + ": cannot be written as a picture");
}

}  // namespace afterglow::calib
