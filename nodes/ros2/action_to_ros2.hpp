/// \file
/// An action whose server is in ROS 1, on ROS 2.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>

#include "nodes/ros2/action_on_ros1.hpp"
#include "nodes/ros2/dds_service.hpp"
#include "replay/ros2/action_relay_to_ros2.hpp"

namespace afterglow::nodes {

/// The server of the action for clients in ROS 2 while it exists, once the server in ROS 1 is met.
class ActionToRos2 {
 public:
  /// `action`: "/fibonacci"; `ros2_type`: "test_msgs/action/Fibonacci". Throws as DdsWriter.
  ActionToRos2(DdsParticipant& participant, const replay::ActionType& type,
               const std::string& action, const std::string& ros2_type);
  /// Cancels the goals of ROS 2, and gives that a moment.
  ~ActionToRos2();
  ActionToRos2(const ActionToRos2&) = delete;
  ActionToRos2& operator=(const ActionToRos2&) = delete;

  /// Begins on ROS 2 once the server tells its status. Returns whether it has begun. Throws as
  /// DdsWriter.
  bool begin();
  /// Whether it has begun, and the server does not tell its status any more.
  bool isServerGone() const { return is_complete_ && !is_alive_; }
  /// Whether a goal of ROS 2 has no end yet.
  bool isBusy() const { return is_busy_; }
  /// Tells ROS 2 that all goals are over.
  void onServerGone();

 private:
  replay::ActionRelayToRos2::Outlets outlets();
  void addService(replay::ActionService service, const std::string& name, const std::string& type);
  /// Keeps what others ask of the relay.
  void note();

  DdsParticipant& participant_;
  const std::string action_, ros2_type_;
  replay::ActionRelayToRos2 relay_;                     ///< used in the thread of `ros1_` alone
  std::atomic<bool> is_alive_{false}, is_busy_{false};  ///< as the relay had it last
  std::atomic<bool> is_complete_{false};                ///< before that, nobody can ask
  std::map<replay::ActionTopic, std::unique_ptr<DdsWriter>> writers_;
  std::map<replay::ActionService, std::unique_ptr<DdsServiceServer>> services_;
  ActionOnRos1 ros1_;  ///< last: its thread uses the rest
};

}  // namespace afterglow::nodes
