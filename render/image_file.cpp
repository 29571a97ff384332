#include "render/image_file.hpp"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace afterglow::render {

void writePng(const std::string& path, const Image& image) {
  if (image.width <= 0 || image.height <= 0 ||
      image.rgb.size() !=
          3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    throw std::logic_error(fmt::format("writePng: an image of {} x {} pixels with {} bytes",
                                       image.width, image.height, image.rgb.size()));
  }
  // OpenCV takes no const data, but cvtColor only reads it.
  const cv::Mat rgb(image.height, image.width, CV_8UC3,
                    const_cast<std::uint8_t*>(image.rgb.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  bool written = false;
  try {
    written = cv::imwrite(path, bgr);
  } catch (const cv::Exception& error) {
    throw std::runtime_error(path + ": cannot be written: " + error.err);
  }
  if (!written) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace afterglow::render
