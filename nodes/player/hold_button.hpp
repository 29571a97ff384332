/// \file
/// The button of a joystick (sensor_msgs/Joy) that has to be held for the robot to move.
#pragma once

#include <sensor_msgs/Joy.h>

#include <cstddef>
#include <functional>
#include <mutex>
#include <string>

#include "nodes/tools/callback_thread.hpp"
#include "replay/motion/hold_to_run.hpp"

namespace afterglow::nodes {

struct HoldButtonOptions {
  std::string topic;  ///< empty: the robot moves without
  std::size_t button = 0;
  double patience_s = 60;  ///< time for somebody to press it

  /// "/joy:10". Throws std::invalid_argument.
  void set(const std::string& text);
};

/// Listens in a thread of its own.
class HoldButton {
 public:
  /// Takes `on_change`, which that thread calls when the hold begins and ends: released, or silent.
  HoldButton(const HoldButtonOptions& options, std::function<void(bool is_held)> on_change);

  bool isHeld();
  /// Says what to press, and returns when it has been held for half a second, which shows that its
  /// joystick repeats itself. Throws std::runtime_error, one line, if nobody presses it in time,
  /// or the joystick falls silent.
  void waitUntilHeld(const std::function<bool()>& is_stopped);

 private:
  using Event = ros::MessageEvent<const sensor_msgs::Joy>;
  void onJoy(const Event& event);
  void tellChange();
  bool isHeldSteadily();
  std::string whyNot();

  const HoldButtonOptions options_;
  const std::string named_;  ///< "button 10 of /joy"
  const std::function<void(bool)> on_change_;
  std::mutex mutex_;
  replay::HoldToRun hold_;
  bool has_button_ = true;  ///< so have the messages
  bool was_held_ = false;   ///< state that on_change_ was told
  CallbackThread thread_;
};

}  // namespace afterglow::nodes
