/// \file
/// A joystick with a button to be held, whose driver repeats itself.
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/Joy.h>

#include <atomic>
#include <cstddef>
#include <string>

namespace afterglow::test {

/// Twenty times a second, and at once when something changes.
class Joystick {
 public:
  Joystick(ros::NodeHandle& node, const std::string& topic, std::size_t button)
      : button_(button), publisher_(node.advertise<sensor_msgs::Joy>(topic, 10)) {
    timer_ = node.createWallTimer(ros::WallDuration(0.05), [this](const ros::WallTimerEvent&) {
      if (!is_silent_) say();
    });
  }
  void press(bool is_pressed) {
    is_pressed_ = is_pressed;
    say();
  }
  /// Its driver or its radio has died.
  void beSilent(bool is_silent) { is_silent_ = is_silent; }

 private:
  void say() {
    sensor_msgs::Joy joy;
    joy.header.stamp = ros::Time::now();
    joy.buttons.assign(button_ + 3, 0);
    joy.buttons[button_] = is_pressed_;
    publisher_.publish(joy);
  }

  const std::size_t button_;
  std::atomic<bool> is_pressed_{false}, is_silent_{false};
  ros::Publisher publisher_;
  ros::WallTimer timer_;
};

}  // namespace afterglow::test
