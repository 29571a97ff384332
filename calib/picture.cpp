#include "calib/picture.hpp"

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

namespace afterglow::calib {

Picture loadPicture(const std::string& path) {
  cv::Mat image;
  try {
    image = cv::imread(path, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    // A size OpenCV refuses to allocate; said below like every other unreadable file.
  }
  if (image.empty()) throw std::runtime_error(path + ": cannot be read as a picture");
  if (image.cols < 16 || image.rows < 16) {
    throw std::runtime_error(path + ": " + std::to_string(image.cols) + " x " +
                             std::to_string(image.rows) + " pixels are too few for tags");
  }
  return {image.cols, image.rows, {image.datastart, image.dataend}};
}

void savePicture(const std::string& path, const Picture& picture) {
  // OpenCV writes from it only.
  const cv::Mat image(picture.height, picture.width, CV_8UC1,
                      const_cast<std::uint8_t*>(picture.pixels.data()));
  bool is_written = false;
  try {
    is_written = cv::imwrite(path, image);
  } catch (const cv::Exception&) {
    // An ending OpenCV does not know.
  }
  if (!is_written) throw std::runtime_error(path + ": the picture cannot be written");
}

}  // namespace afterglow::calib
