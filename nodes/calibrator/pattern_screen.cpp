#include "nodes/calibrator/pattern_screen.hpp"

#include <fcntl.h>
#include <ros/time.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

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

/// The file of a light, open as long as this lives: a serial port resets what is behind it.
class LatencyMeasurement::Led {
 public:
  explicit Led(const std::string& path)
      : path_(path), file_(::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {
    if (file_ < 0) fail("cannot be opened");
  }
  ~Led() {
    ::lseek(file_, 0, SEEK_SET);
    [[maybe_unused]] const ssize_t ignored = ::write(file_, "0\n", 2);
    ::close(file_);
  }
  Led(const Led&) = delete;
  Led& operator=(const Led&) = delete;

  calib::ClockReading switchTo(bool is_lit) {
    ::lseek(file_, 0, SEEK_SET);  // where that can be: the kernel's files want it
    const calib::ClockReading now = readClocks();
    if (::write(file_, is_lit ? "1\n" : "0\n", 2) != 2) fail("cannot be written");
    return now;
  }

 private:
  [[noreturn]] void fail(const char* what) const {
    throw std::runtime_error(path_ + ": " + what + ": " + std::strerror(errno));
  }

  const std::string path_;
  const int file_;
};

namespace {

calib::ClockReading show(PatternScreen& screen, bool is_lit) {
  return screen.show(is_lit ? calib::Shown::Plain : calib::Shown::Black);
}

}  // namespace

LatencyMeasurement::LatencyMeasurement(PatternScreen& screen, const std::string& led)
    : led_(led.empty() ? nullptr : std::make_unique<Led>(led)), run_([&] {
        std::vector<calib::LatencyRun::Switch> lights = {
            [&screen](bool is_lit) { return show(screen, is_lit); }};
        if (led_) lights.push_back([this](bool is_lit) { return led_->switchTo(is_lit); });
        return lights;
      }()) {
  if (ros::Time::isSimTime()) {
    throw calib::LatencyRefused("a delay is measured in real time: /use_sim_time is set");
  }
  screen.show(calib::Shown::Black);
  if (led_) led_->switchTo(false);
}

LatencyMeasurement::~LatencyMeasurement() = default;

std::chrono::nanoseconds LatencyMeasurement::goOn() {
  const std::int64_t due_ns = run_.goOn(readClocks().steady_ns);
  return std::chrono::nanoseconds(std::max(std::int64_t{0}, due_ns - readClocks().steady_ns));
}

void LatencyMeasurement::see(const CameraImage& image) {
  run_.see(calib::timedImage(image.picture, image.stamp_ns, image.arrived));
}

calib::ProjectorDelay LatencyMeasurement::delay(calib::StampMeaning stamps) const {
  const auto reference = led_ ? std::optional(run_.seen().back()) : std::nullopt;
  return calib::separate(seen(), stamps, reference);
}

}  // namespace afterglow::nodes
