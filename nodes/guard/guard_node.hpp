/// \file
/// The guard on the robot, the program afterglow_guard: hears that players live (guard_messages.hpp
/// names the topics) and stops what a player had in motion when it, its machine or the network is
/// gone. C++14, with nothing but roscpp: it is built on robots with old systems, too.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "nodes/guard/guarded_player.hpp"

namespace afterglow {
namespace nodes {

/// Beats are heard in one thread, publishers are made in another (the master may be slow, or gone),
/// and the one that runs it stops the robot.
class GuardNode {
 public:
  /// Makes a way for every output; those that are known already are kept. May take long. Throws
  /// std::runtime_error, one line, where a robot could not be stopped.
  using MakeWays =
      std::function<GuardedPlayer::Ways(const GuardOutputs&, const GuardedPlayer::Ways& known)>;

  /// `make_ways`: for a robot on another graph, over which the beats come as well: hear(). Empty:
  /// the robot is on ROS 1. Throws std::system_error when the process has no file descriptors left.
  explicit GuardNode(MakeWays make_ways = {});
  ~GuardNode();
  GuardNode(const GuardNode&) = delete;
  GuardNode& operator=(const GuardNode&) = delete;

  /// Returns when it has been told to end (stop_signal.hpp), what was in motion is stopped, and the
  /// stops have left.
  void run();
  /// Any thread.
  void hear(const GuardBeat& beat);

 private:
  void watch();
  void onOutputs(const GuardOutputs& outputs);
  void know(const GuardOutputs& outputs);
  void onTimer(const ros::WallTimerEvent&);
  replay::SteadyTime step();
  bool stopAll(const std::string& reason);
  void waitUntil(replay::SteadyTime deadline, bool is_ending) const;
  void wake() const;

  const MakeWays make_ways_;
  int waker_ = -1;
  std::mutex mutex_;
  ros::CallbackQueue beats_queue_, outputs_queue_;  ///< first: publishers go before their queues
  ros::NodeHandle beats_node_, outputs_node_;
  std::map<std::uint64_t, GuardedPlayer> players_;
  ros::Publisher answers_;
  ros::Subscriber beats_, outputs_;
  ros::WallTimer timer_;
  ros::AsyncSpinner beats_spinner_, outputs_spinner_;
};

}  // namespace nodes
}  // namespace afterglow
