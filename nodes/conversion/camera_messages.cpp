#include "nodes/conversion/camera_messages.hpp"

#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "calib/lens.hpp"

namespace afterglow::nodes {
namespace {

namespace encodings = sensor_msgs::image_encodings;

constexpr std::uint32_t kSmallest = 16, kLargest = 16384;  // px; libapriltag needs 16

struct Channels {
  std::size_t bytes = 1;          ///< a pixel
  std::size_t red = 0, blue = 0;  ///< green is always the second
};

[[noreturn]] void refuse(const std::string& reason) { throw std::invalid_argument(reason); }

Channels channelsOf(const std::string& encoding) {
  if (encoding == encodings::MONO8 || encoding == encodings::TYPE_8UC1) return {1, 0, 0};
  if (encoding == encodings::RGB8) return {3, 0, 2};
  if (encoding == encodings::BGR8 || encoding == encodings::TYPE_8UC3) return {3, 2, 0};
  if (encoding == encodings::RGBA8) return {4, 0, 2};
  if (encoding == encodings::BGRA8) return {4, 2, 0};
  const std::string shown = "image encoding '" + encoding.substr(0, 40) + "'";
  if (encoding.rfind("bayer_", 0) == 0) {
    refuse(shown +
           " is a sensor's raw mosaic: let image_proc turn it into image_mono, or set the "
           "camera to mono8 or rgb8");
  }
  if (encoding.find("16") != std::string::npos) {
    refuse(shown + " has 16 bits a channel: set the camera to mono8, rgb8 or bgr8");
  }
  refuse(shown + " cannot be used: mono8, rgb8, bgr8, rgba8 and bgra8 can");
}

/// Rec. 601, rounded; what OpenCV does.
std::uint8_t grayOf(const std::uint8_t* pixel, const Channels& channels) {
  const unsigned sum =
      299U * pixel[channels.red] + 587U * pixel[1] + 114U * pixel[channels.blue] + 500U;
  return static_cast<std::uint8_t>(sum / 1000U);
}

/// Refuses what toPicture() does.
Channels checkedChannels(const sensor_msgs::Image& message) {
  const Channels channels = channelsOf(message.encoding);
  const std::string size = std::to_string(message.width) + "x" + std::to_string(message.height);
  const auto fits = [](std::uint32_t side) { return side >= kSmallest && side <= kLargest; };
  if (!fits(message.width) || !fits(message.height)) {
    refuse("an image of " + size + " px: 16 to 16384 px a side are possible");
  }
  const std::size_t row_bytes = channels.bytes * message.width;
  if (message.step < row_bytes) {
    refuse("image step " + std::to_string(message.step) + " is below the " +
           std::to_string(row_bytes) + " bytes of a row of " + size + " " + message.encoding);
  }
  const std::size_t needed = std::size_t{message.step} * (message.height - 1) + row_bytes;
  if (message.data.size() < needed) {
    refuse("image data has " + std::to_string(message.data.size()) + " bytes, " + size + " " +
           message.encoding + " needs " + std::to_string(needed));
  }
  return channels;
}

}  // namespace

calib::Picture toPicture(const sensor_msgs::Image& message) {
  const Channels channels = checkedChannels(message);
  calib::Picture picture;
  picture.width = static_cast<int>(message.width);
  picture.height = static_cast<int>(message.height);
  picture.pixels.resize(std::size_t{message.width} * message.height);
  auto* out = picture.pixels.data();
  for (std::size_t y = 0; y < message.height; ++y) {
    const std::uint8_t* row = message.data.data() + y * message.step;
    if (channels.bytes == 1) {
      out = std::copy_n(row, message.width, out);
    } else {
      for (std::size_t x = 0; x < message.width; ++x)
        *out++ = grayOf(row + x * channels.bytes, channels);
    }
  }
  return picture;
}

render::Image toColors(const sensor_msgs::Image& message) {
  const Channels channels = checkedChannels(message);
  const std::size_t green = channels.bytes == 1 ? 0 : 1;
  render::Image image{static_cast<int>(message.width), static_cast<int>(message.height), {}};
  image.rgb.reserve(std::size_t{3} * message.width * message.height);
  for (std::size_t y = 0; y < message.height; ++y) {
    const std::uint8_t* pixel = message.data.data() + y * message.step;
    for (std::size_t x = 0; x < message.width; ++x, pixel += channels.bytes) {
      for (const std::size_t channel : {channels.red, green, channels.blue}) {
        image.rgb.push_back(pixel[channel]);
      }
    }
  }
  return image;
}

calib::Lens toLens(const sensor_msgs::CameraInfo& message) {
  const bool is_zero =
      std::all_of(message.K.begin(), message.K.end(), [](double k) { return k == 0; });
  if (is_zero) {
    refuse(
        "camera_info: K is all zero, so the camera is not calibrated: calibrate it first "
        "(camera_calibration), or name a file in ~camera_info_file");
  }
  const std::string& model = message.distortion_model;
  const auto known = model.empty() && message.D.empty() ? calib::LensModel::BrownConrady
                                                        : calib::lensModelNamed(model);
  if (!known) {
    refuse("camera_info: distortion_model '" + model.substr(0, 40) +
           "' is unknown: plumb_bob, rational_polynomial and equidistant can be used");
  }
  const bool has_region = message.roi.width != 0 && (message.roi.width != message.width ||
                                                     message.roi.height != message.height);
  if (message.binning_x > 1 || message.binning_y > 1 || has_region || message.roi.x_offset != 0 ||
      message.roi.y_offset != 0) {
    refuse(
        "camera_info: binning or a region of interest is set, and K is for the whole sensor: "
        "switch both off");
  }
  Eigen::Matrix3d K;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      K(row, column) = message.K[static_cast<std::size_t>(3 * row + column)];
    }
  }
  const auto clamped = [](std::uint32_t side) {
    return static_cast<int>(std::min<std::uint32_t>(side, 1U << 30));
  };
  try {
    return calib::makeLens(clamped(message.width), clamped(message.height), K, calib::usedDistortion(model, message.D), *known);
  } catch (const std::invalid_argument& error) {
    refuse(std::string("camera_info: ") + error.what());
  }
}

sensor_msgs::Image toImage(render::Image image) {
  sensor_msgs::Image message;
  message.width = static_cast<std::uint32_t>(image.width);
  message.height = static_cast<std::uint32_t>(image.height);
  message.step = 3 * message.width;
  message.encoding = sensor_msgs::image_encodings::RGB8;
  message.data = std::move(image.rgb);
  return message;
}

sensor_msgs::CameraInfo toCameraInfo(const calib::Lens& lens) {
  sensor_msgs::CameraInfo message;
  message.width = static_cast<std::uint32_t>(lens.width);
  message.height = static_cast<std::uint32_t>(lens.height);
  message.distortion_model = calib::distortionModel(lens);
  message.D = calib::distortionCoefficients(lens);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const auto at = static_cast<std::size_t>(row);
      const auto on = static_cast<std::size_t>(column);
      message.K[3 * at + on] = lens.K(row, column);
      message.P[4 * at + on] = lens.K(row, column);
      message.R[3 * at + on] = row == column ? 1 : 0;
    }
  }
  return message;
}

}  // namespace afterglow::nodes
