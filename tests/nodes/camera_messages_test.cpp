#include "nodes/conversion/camera_messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

namespace afterglow::nodes::camera_messages_test {
namespace {

/// Two pixels of interest in the first row, then padding at each row's end.
sensor_msgs::Image image(const std::string& encoding, std::uint32_t bytes) {
  sensor_msgs::Image message;
  message.width = 20;
  message.height = 16;
  message.encoding = encoding;
  message.step = bytes * message.width + 5;
  message.data.assign(message.step * message.height, 7);
  return message;
}

sensor_msgs::CameraInfo info() {
  sensor_msgs::CameraInfo message;
  message.width = 640;
  message.height = 480;
  message.distortion_model = "plumb_bob";
  message.D = {-0.1, 0.05, 0.001, -0.001, 0};
  message.K = {600, 0, 320, 0, 601, 240, 0, 0, 1};
  return message;
}

template <typename Act>
std::string refusalOf(const Act& act) {
  try {
    act();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "not refused";
}

std::string pictureRefusal(const sensor_msgs::Image& message) {
  return refusalOf([&] { toPicture(message); });
}

std::string lensRefusal(const sensor_msgs::CameraInfo& message) {
  return refusalOf([&] { toLens(message); });
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(CameraPicture, leavesOutThePaddingOfRows) {
  sensor_msgs::Image message = image("mono8", 1);
  message.data[message.step] = 99;
  const calib::Picture picture = toPicture(message);
  EXPECT_EQ(picture.width, 20);
  EXPECT_EQ(picture.height, 16);
  EXPECT_EQ(picture.pixels.size(), 320u);
  EXPECT_EQ(picture.at(0, 1), 99);
  message.data.resize(message.data.size() - 5);  // the last row may go without
  EXPECT_EQ(toPicture(message).pixels, picture.pixels);
}

TEST(CameraPicture, turnsColorIntoGray) {
  for (const auto& [encoding, bytes, red_at] :
       {std::tuple("rgb8", 3U, 0U), {"bgr8", 3U, 2U}, {"rgba8", 4U, 0U}, {"bgra8", 4U, 2U}}) {
    sensor_msgs::Image message = image(encoding, bytes);
    std::fill(message.data.begin(), message.data.end(), 0);
    message.data[bytes + red_at] = 200;
    EXPECT_EQ(toPicture(message).at(1, 0), 60) << encoding;
    EXPECT_EQ(toPicture(message).at(0, 0), 0) << encoding;
  }
}

TEST(CameraPicture, refusesByName) {
  EXPECT_TRUE(contains(pictureRefusal(image("mono16", 2)), "'mono16' has 16 bits a channel"));
  EXPECT_TRUE(contains(pictureRefusal(image("16UC1", 2)), "16 bits"));
  EXPECT_TRUE(contains(pictureRefusal(image("bayer_rggb8", 1)), "let image_proc turn it into"));
  EXPECT_TRUE(contains(pictureRefusal(image("yuv422", 2)), "'yuv422' cannot be used"));
  sensor_msgs::Image message = image("rgb8", 3);
  message.step = 59;
  EXPECT_EQ(pictureRefusal(message), "image step 59 is below the 60 bytes of a row of 20x16 rgb8");
  message = image("mono8", 1);
  message.data.resize(300);
  EXPECT_EQ(pictureRefusal(message), "image data has 300 bytes, 20x16 mono8 needs 395");
  message = image("mono8", 1);
  message.height = 4'000'000'000U;
  EXPECT_TRUE(contains(pictureRefusal(message), "16 to 16384 px a side"));
  message = image("mono8", 1);
  message.width = 3;
  EXPECT_TRUE(contains(pictureRefusal(message), "16 to 16384 px a side"));
}

TEST(CameraLens, isReadFromKAndD) {
  const calib::Lens lens = toLens(info());
  EXPECT_EQ(lens.width, 640);
  EXPECT_EQ(lens.K(1, 1), 601);
  EXPECT_EQ(lens.K(1, 2), 240);
  EXPECT_EQ(lens.D[3], -0.001);
}

TEST(CameraLens, mayBeAFisheye) {
  sensor_msgs::CameraInfo message = info();
  message.distortion_model = "equidistant";
  message.D = {0.1, 0.02, 0.03, 0.04};
  EXPECT_EQ(toLens(message).model, calib::LensModel::Equidistant);
  message.D.resize(14);  // what drivers of OpenCV's cameras send
  EXPECT_EQ(toLens(message).D[3], 0.04);
  message.D[13] = 1;
  EXPECT_TRUE(contains(lensRefusal(message), "found 14, and those beyond are not all 0"));
}

TEST(CameraLens, isRefusedByName) {
  sensor_msgs::CameraInfo message = info();
  message.K.assign(0);
  EXPECT_TRUE(contains(lensRefusal(message), "K is all zero, so the camera is not calibrated"));
  message = info();
  message.K[4] = std::nan("");
  EXPECT_TRUE(contains(lensRefusal(message), "camera_info: ")) << lensRefusal(message);
  message = info();
  message.distortion_model = "fov";
  EXPECT_TRUE(contains(lensRefusal(message), "distortion_model 'fov' is unknown"));
  message.distortion_model = "equidistant";
  message.D.resize(3);
  EXPECT_TRUE(contains(lensRefusal(message), "equidistant has 4 numbers, found 3"));
  message = info();
  message.binning_x = 2;
  EXPECT_TRUE(contains(lensRefusal(message), "binning"));
  message = info();
  message.roi.y_offset = 10;
  EXPECT_TRUE(contains(lensRefusal(message), "region of interest"));
  message = info();
  message.D = {0.1, 0.2};
  EXPECT_NE(lensRefusal(message), "not refused");
  message = info();
  message.width = 0;
  EXPECT_NE(lensRefusal(message), "not refused");
}

}  // namespace
}  // namespace afterglow::nodes::camera_messages_test
