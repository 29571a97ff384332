/// \file
/// The way to the guard on the robot (nodes/guard/), and whether there is one.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

#include "nodes/player/watchdog.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// Returns the name of the guard on the robot: afterglow_guard, in this node's namespace.
std::string robotGuardName();

/// Said where none runs.
extern const char* const kNoRobotGuard;

/// Guards stop robots, they do not drive them: this node's watchdog, and the guard on the robot.
bool isGuard(const std::string& node);
/// Somebody else: neither this node nor one of its guards.
bool isAnother(const std::string& node);

/// Topics (guard_messages.hpp).
class RobotGuard : public GuardWay {
 public:
  /// Returns true if it runs and answers. Takes at most half a second.
  static bool isThere(const RosGraph& graph);

  RobotGuard();

  void send(const GuardOutputs& outputs) override { outputs_.publish(outputs); }
  void send(const GuardBeat& beat) override;
  GuardAnswer answer() override;
  bool isOpen() override;
  bool isSure() const override { return false; }

 private:
  bool was_found_ = false;
  std::mutex mutex_;          ///< guards what follows
  std::uint64_t player_ = 0;  ///< the player whose beats were sent
  GuardAnswer arrived_;       ///< the latest to it
  ros::NodeHandle node_;
  ros::Publisher outputs_, beats_;
  CallbackThread thread_;
};

}  // namespace afterglow::nodes
