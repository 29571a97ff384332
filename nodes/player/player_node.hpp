/// \file
/// player_node: replays stored behaviors into the running robot by action (`replay`), with services
/// ~stop, ~pause, ~resume and a latched ~status.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/ReplayStatus.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "nodes/player/replay_session.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Private parameters of player_node.
struct PlayerNodeOptions {
  std::string store;                    ///< ~store, as openStore() takes it
  bool allow_motion = false;            ///< ~allow_motion
  double wait_for_subscribers_s = 2.0;  ///< ~wait_for_subscribers
  bool clear_projection = true;         ///< ~clear_projection
  double hold_s = 2.0;                  ///< ~hold: how long the light stays after the end
  double goal_wait_s = 10.0;            ///< ~goal_wait: how long goals may take beyond the end

  static PlayerNodeOptions read(const ros::NodeHandle& private_node);
};

/// One replay at a time; a new goal stops the one before, as actionlib's simple server has it.
class PlayerNode {
 public:
  explicit PlayerNode(const PlayerNodeOptions& options);
  /// As close().
  ~PlayerNode();

  /// Stops what is played and waits until the robot has been told; refuses further goals.
  void close(const std::string& reason);

 private:
  using Server = actionlib::SimpleActionServer<ReplayAction>;
  using Trigger = std_srvs::Trigger;

  void onGoal(const ReplayGoalConstPtr& goal);
  ReplayRequest requestOf(const ReplayGoal& goal) const;
  void play(const ReplayRequest& request);
  void onTimer();
  bool command(Trigger::Response& response, const char* done,
               const std::function<void(ReplaySession&)>& command);
  ReplayStatus status() const;
  void show(std::shared_ptr<ReplaySession> session, const std::string& message);
  void publishStatus(const std::string& message);
  void setSession(std::shared_ptr<ReplaySession> session);

  const PlayerNodeOptions options_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<ReplaySession> session_;  ///< shared with whoever commands it just now
  bool is_closing_ = false;

  std::mutex status_mutex_;  ///< taken before mutex_: what ~status says follows what is so
  std::uint8_t shown_state_ = ReplayStatus::IDLE;

  ros::NodeHandle node_, private_node_{"~"};
  ros::Publisher status_;
  ros::ServiceServer stop_, pause_, resume_;
  ros::WallTimer timer_;
  Server server_;
};

}  // namespace afterglow::nodes
