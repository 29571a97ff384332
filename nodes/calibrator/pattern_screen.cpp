#include "nodes/calibrator/pattern_screen.hpp"

#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>

#include <utility>

#include "calib/targets/pattern.hpp"

namespace afterglow::nodes {
namespace {

calib::Picture plainPicture(const calib::Pattern& pattern, std::uint8_t gray) {
  const auto pixels =
      static_cast<std::size_t>(pattern.width) * static_cast<std::size_t>(pattern.height);
  return {pattern.width, pattern.height, std::vector<std::uint8_t>(pixels, gray)};
}

}  // namespace

calib::ClockReading readClocks() {
  const auto steady = std::chrono::steady_clock::now().time_since_epoch();
  return {static_cast<std::int64_t>(ros::Time::now().toNSec()),
          std::chrono::duration_cast<std::chrono::nanoseconds>(steady).count()};
}

PatternScreen::PatternScreen(const calib::Pattern& pattern, const std::string& frame_id,
                             const std::string& topic)
    : pictures_{plainPicture(pattern, 0), plainPicture(pattern, calib::kPlainGray),
                calib::patternPicture(pattern)},
      frame_id_(frame_id) {
  publisher_ = nh_.advertise<sensor_msgs::Image>(ros::names::resolve(topic), 4, true);
  publish(shown_);
}

const calib::Picture& PatternScreen::pictureOf(calib::Shown shown) const {
  return pictures_[static_cast<std::size_t>(shown)];
}

calib::ClockReading PatternScreen::show(calib::Shown shown) {
  calib::ClockReading now;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (shown == shown_) return readClocks();
    shown_ = shown;
    is_changed_ = true;
    publish(shown);
    now = readClocks();
  }
  changed_.notify_one();
  return now;
}

void PatternScreen::publish(calib::Shown shown) {
  const calib::Picture& picture = pictureOf(shown);
  sensor_msgs::Image message;
  message.header.stamp = ros::Time::now();
  message.header.frame_id = frame_id_;
  message.width = message.step = static_cast<std::uint32_t>(picture.width);
  message.height = static_cast<std::uint32_t>(picture.height);
  message.encoding = sensor_msgs::image_encodings::MONO8;
  message.data = picture.pixels;
  publisher_.publish(message);
}

std::optional<calib::Picture> PatternScreen::takeChanged(std::chrono::milliseconds patience) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait_for(lock, patience, [this] { return is_changed_; });
  if (!std::exchange(is_changed_, false)) return std::nullopt;
  return pictureOf(shown_);
}

}  // namespace afterglow::nodes
