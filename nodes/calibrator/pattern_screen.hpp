/// \file
/// The projector's picture, on ~pattern and for whoever has a window.
///
/// Measures the delay of what a screen shows, seen by a camera: projector's pictures, and perhaps a
/// second light beside them.
#pragma once

#include <ros/ros.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "calib/guide/view_taker.hpp"
#include "calib/latency/latency.hpp"
#include "calib/picture.hpp"
#include "calib/targets/pattern.hpp"
#include "nodes/calibrator/camera_subscriber.hpp"

namespace afterglow::nodes {

/// The clocks as they are now: ROS time, and one that never jumps.
calib::ClockReading readClocks();

/// The screen; used from any thread, black at first.
class PatternScreen {
 public:
  PatternScreen(const calib::Pattern& pattern, const std::string& frame_id,
                const std::string& topic = "~pattern");

  /// Publishes the picture if it is another one than before, and hands it to the window. Returns
  /// the moment of that.
  calib::ClockReading show(calib::Shown shown);
  /// The picture, if it has changed since the last call; waits for that at most so long.
  std::optional<calib::Picture> takeChanged(std::chrono::milliseconds patience);
  int width() const { return pictures_[0].width; }
  int height() const { return pictures_[0].height; }

 private:
  void publish(calib::Shown shown);
  const calib::Picture& pictureOf(calib::Shown shown) const;

  std::array<calib::Picture, 3> pictures_;  ///< pictures by calib::Shown
  std::string frame_id_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  calib::Shown shown_ = calib::Shown::Black;
  bool is_changed_ = true;
  ros::NodeHandle nh_;
  ros::Publisher publisher_;
};

/// Used by one thread. Everything throws calib::LatencyRefused and, of the second light's file,
/// std::runtime_error.
class LatencyMeasurement {
 public:
  /// `led`: a file that a light follows, which is on after "1" was written and off after "0": below
  /// /sys/class/leds, a GPIO's, a serial port's; empty: there is none. `screen` must outlive this.
  LatencyMeasurement(PatternScreen& screen, const std::string& led);
  ~LatencyMeasurement();

  /// Switches what is due; returns the time until something else is. To be called again then, or
  /// sooner.
  std::chrono::nanoseconds goOn();
  void see(const CameraImage& image);
  bool isDone() const { return run_.isDone(); }

  /// The delay of the screen, once it is done.
  const calib::SeenDelay& seen() const { return run_.seen().front(); }
  calib::ProjectorDelay delay(calib::StampMeaning stamps) const;

 private:
  class Led;

  std::unique_ptr<Led> led_;  ///< null: there is none
  calib::LatencyRun run_;
};

}  // namespace afterglow::nodes
