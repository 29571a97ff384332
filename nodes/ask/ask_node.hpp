/// \file
/// ask_node: answers people's questions about what the robot did, in words or by a replay of
/// player_node.
#pragma once

#include <actionlib/client/simple_action_client.h>
#include <actionlib/server/simple_action_server.h>
#include <afterglow/AskAction.h>
#include <afterglow/ReplayAction.h>
#include <ros/ros.h>
#include <std_msgs/String.h>

#include <atomic>
#include <mutex>
#include <string>

#include "replay/ask/asking.hpp"

namespace afterglow::nodes {

/// Private parameters of ask_node.
struct AskNodeOptions {
  std::string store;                    ///< ~store, as openStore() takes it
  std::string questions;                ///< ~questions, a file; empty: those that are built in
  std::string player = "player_node";  ///< ~player: whose allow_motion holds
  bool allow_motion = false;            ///< ~allow_motion, of answers

  static AskNodeOptions read(const ros::NodeHandle& private_node);
};

/// The action `ask`, and the topic ~ask for speech recognizers, which goes the same way. One
/// question at a time. Needs a running spinner.
class AskNode {
 public:
  /// Throws std::runtime_error, one line, for a file of questions that is not understood.
  explicit AskNode(const AskNodeOptions& options);

 private:
  using Server = actionlib::SimpleActionServer<AskAction>;

  void onHeard(const std_msgs::String& text);
  void onGoal(const AskGoalConstPtr& goal);
  AskResult answer(const std::string& question);
  bool replay(const replay::AskAnswer& answer, AskResult& result);
  bool replayOnce(const std::string& behavior, bool moves);
  bool wasRefused();
  bool mayMove(const replay::AskAnswer& answer) const;
  void say(const std::string& sentence);

  const AskNodeOptions options_;
  ros::NodeHandle node_, private_node_{"~"};
  replay::Asking asking_;  ///< conversation of the action's thread
  std::atomic<bool> is_answering_{false};
  std::mutex mutex_;
  ros::WallTime quiet_from_;              ///< the robot speaks until then, as far as is known
  ros::Publisher goals_, speech_;
  actionlib::SimpleActionClient<ReplayAction> player_{"replay", false};
  Server server_;
  ros::Subscriber heard_;
};

}  // namespace afterglow::nodes
