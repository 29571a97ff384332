/// \file
/// The projector's picture, on ~pattern and for whoever has a window.
#pragma once

#include <ros/ros.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>

#include "calib/guide/view_taker.hpp"
#include "calib/latency/latency.hpp"
#include "calib/picture.hpp"
#include "calib/targets/pattern.hpp"

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

}  // namespace afterglow::nodes
