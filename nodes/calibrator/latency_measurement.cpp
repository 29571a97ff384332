#include "nodes/calibrator/latency_measurement.hpp"

#include <fcntl.h>
#include <ros/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace afterglow::nodes {

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
