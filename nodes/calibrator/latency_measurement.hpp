/// \file
/// Measures the delay of what a screen shows, seen by a camera: projector's pictures, and perhaps a
/// second light beside them.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "calib/latency/latency.hpp"
#include "nodes/calibrator/camera_subscriber.hpp"
#include "nodes/calibrator/pattern_screen.hpp"

namespace afterglow::nodes {

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
