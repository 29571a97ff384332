/// \file
/// The watchdog of a replay, a program of its own (afterglow_replay_guard): when the player dies or
/// hangs, it stops what the player had in motion.
#pragma once

#include <ros/ros.h>
#include <topic_tools/shape_shifter.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nodes/player/guard_link.hpp"
#include "replay/clock/clock.hpp"
#include "replay/motion/heartbeat.hpp"

namespace afterglow::nodes {

/// Serves one player, at the other end of the link (guard_link.hpp).
class ReplayGuard {
 public:
  explicit ReplayGuard(GuardLink& link) : link_(link) {}

  /// Returns when the player has ended, or what it had in motion has been stopped: as the player is
  /// gone, or as this program was told to end (stop_signal.hpp).
  void run();

 private:
  struct Output {
    ros::Publisher publisher;
    topic_tools::ShapeShifter stop;
    bool may_be_unheard = false;
  };

  void hear(const nlohmann::json& message);
  void setOutput(const nlohmann::json& message);
  void connect();
  void waitForNews();
  void brake();
  void tell(const replay::Outputs& stopped) const;

  GuardLink& link_;
  replay::HeartbeatWatch watch_{replay::HeartbeatWatch::Options()};
  replay::SteadyClock clock_;  ///< to sleep on
  ros::NodeHandle node_;
  std::vector<Output> outputs_;
  bool has_told_ = false;
};

}  // namespace afterglow::nodes
