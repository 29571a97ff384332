/// \file
/// The player's side of the guard on the robot (nodes/guard/): finds it, tells it what is in
/// motion, and hears whether it is there.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "nodes/guard/guard_messages.hpp"
#include "nodes/player/watchdog.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/motion/patience.hpp"

namespace afterglow::nodes {

/// What the guard on the robot is called: afterglow_guard, in this node's namespace.
std::string robotGuardName();

/// Said where none runs.
extern const char* const kNoRobotGuard;

/// Guards stop robots, they do not drive them: this node's watchdog, and the guard on the robot.
bool isGuard(const std::string& node);

class RobotGuard : public Watchdog {
 public:
  /// Whether it runs and answers. Takes at most half a second.
  static bool isThere(const RosGraph& graph);

  /// `graph` says who hears the outputs.
  explicit RobotGuard(const RosGraph& graph);
  ~RobotGuard() override;
  RobotGuard(const RobotGuard&) = delete;
  RobotGuard& operator=(const RobotGuard&) = delete;

  void tellOutputs(const std::vector<replay::MotionWatch::Output>& outputs) override;
  void tellOutput(const std::vector<replay::MotionWatch::Output>& outputs,
                  std::uint32_t changed) override;
  /// Beside the player it is as patient as is asked for; over a network as patience() says.
  void beat(const replay::Outputs& moving, std::int64_t patience_ns) override;
  void stop() override;
  void end() override;
  void listen() override;
  bool isReady() const override { return is_ready_; }
  const std::string& whyLost() const override { return lost_; }

  /// After isReady(), which comes when the link has been measured.
  bool isBeside() const { return answer_.is_beside != 0; }
  /// Until it stops the robot, if `patience_ns` is asked for.
  std::int64_t patience(std::int64_t patience_ns) const;
  /// Between two beats, as they got there.
  std::int64_t longestGapNs() const { return answer_.longest_gap_us * std::int64_t{1000}; }

 private:
  void send(const replay::Outputs& moving, std::int64_t patience_ns, bool stops, bool ends);
  void sendOutputs();
  void sendOutputsIfDue();
  bool isHeard() const;
  bool isConnected();
  bool isMeasured();
  void lose(const std::string& reason);

  const RosGraph graph_;
  GuardOutputs outputs_;
  std::uint32_t count_ = 0, first_answered_ = 0;  ///< of beats
  std::optional<Deadline> resend_at_, connected_by_;
  std::int64_t afar_ns_ = 0;  ///< its patience over a network, as measured
  bool is_ready_ = false;
  std::string lost_;
  GuardAnswer answer_;  ///< the latest that was taken in

  std::mutex mutex_;     ///< for what follows
  GuardAnswer arrived_;  ///< the latest
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Publisher outputs_topic_, beats_;
  ros::Subscriber answers_;
  ros::AsyncSpinner spinner_{1, &queue_};  ///< last: it uses all of the above
};

}  // namespace afterglow::nodes
