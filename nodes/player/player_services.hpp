/// \file
/// The services of player_node: what ros2 bag play has, and rosbag play's pause_playback.
#pragma once

#include <afterglow/PlayBehavior.h>
#include <afterglow/ReplayGoal.h>
#include <ros/ros.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nodes/player/replay_session.hpp"

namespace afterglow::nodes {

/// ~play, ~stop, ~pause, ~resume, ~toggle_paused, ~is_paused, ~set_rate, ~get_rate, ~seek,
/// ~play_next, ~burst, ~pause_playback. Each answers with what it did, or why it did not.
class PlayerServices {
 public:
  struct Player {
    /// What is played; none: nothing is.
    std::function<std::shared_ptr<ReplaySession>()> session;
    /// Throws std::runtime_error, one line, for a goal that would be refused.
    std::function<void(const ReplayGoal&)> check;
  };
  PlayerServices(const ros::NodeHandle& private_node, const std::string& action, Player player);
  ~PlayerServices();

 private:
  using Command = std::function<std::string(ReplaySession&)>;

  void serveTrigger(const std::string& name, const Command& command);
  template <typename Service>
  void serve(const std::string& name,
             std::function<std::string(ReplaySession&, const typename Service::Request&)> command);
  bool play(PlayBehavior::Request& request, PlayBehavior::Response& response);

  ros::NodeHandle node_;
  const Player player_;
  ros::Publisher goals_;  ///< to this node's own action
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace afterglow::nodes
