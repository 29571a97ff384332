/// \file
/// twist_mux, simulated (noetic-devel): it passes on the velocity of the highest priority that was
/// heard within half a second, unless a lock of a higher one is shut. It sends nothing by itself:
/// an input that falls silent is no zero.
#pragma once

#include <geometry_msgs/Twist.h>
#include <ros/ros.h>
#include <std_msgs/Bool.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "tests/support/robots/robot_facts.hpp"

namespace afterglow::test {

/// For one thread, which spins.
class TwistMux {
 public:
  explicit TwistMux(const MuxFacts& facts) {
    output_ = node_.advertise<geometry_msgs::Twist>(facts.output, 10);
    for (const MuxFacts::Input& input : facts.inputs) {
      subscribers_.push_back(node_.subscribe<geometry_msgs::Twist>(
          input.topic, 1, [this, input](const auto& twist) { onTwist(input.priority, *twist); }));
    }
    for (const MuxFacts::Input& lock : facts.locks) {
      subscribers_.push_back(
          node_.subscribe<std_msgs::Bool>(lock.topic, 1, [this, lock](const auto& word) {
            locks_[lock.topic] = word->data ? lock.priority : 0;
          }));
    }
  }

 private:
  void onTwist(int priority, const geometry_msgs::Twist& twist) {
    const ros::WallTime now = ros::WallTime::now();
    heard_[priority] = now;
    const bool is_outranked = std::any_of(heard_.begin(), heard_.end(), [&](const auto& other) {
      return other.first > priority && now - other.second < ros::WallDuration(0.5);
    });
    const bool is_locked = std::any_of(locks_.begin(), locks_.end(), [&](const auto& lock) {
      return lock.second > priority;
    });
    if (!is_outranked && !is_locked) output_.publish(twist);
  }

  std::map<int, ros::WallTime> heard_;  ///< by priority
  std::map<std::string, int> locks_;    ///< by topic: the priority below which it shuts; 0: open
  ros::NodeHandle node_;
  ros::Publisher output_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace afterglow::test
