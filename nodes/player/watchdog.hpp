/// \file
/// Guards as their player sees them: the watchdog beside it, a process of its own, and the guard on
/// the robot. They stop the robot when the player is gone.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/guard/guard_messages.hpp"
#include "nodes/guard/guard_socket.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/motion/stops/motion_monitor.hpp"
#include "replay/motion/stops/patience.hpp"

namespace afterglow::nodes {

/// The way to a guard and back. What is sent is sent at once and never blocks. One thread at a
/// time.
class GuardWay {
 public:
  virtual ~GuardWay() = default;
  GuardWay() = default;
  GuardWay(const GuardWay&) = delete;
  GuardWay& operator=(const GuardWay&) = delete;

  virtual void send(const GuardOutputs& outputs) = 0;
  virtual void send(const GuardBeat& beat) = 0;
  /// The latest to the player whose beats were sent.
  virtual GuardAnswer answer() = 0;
  /// False: the guard was there, and is gone.
  virtual bool isOpen() = 0;
  /// False: outputs may be lost, and are not sent with every change.
  virtual bool isSure() const = 0;
};

/// The messages to a guard, and its answers. One thread at a time.
class Watchdog {
 public:
  /// Who hears the outputs: nodes by topic. All of them, but for dead ones, which never connect and
  /// are not waited for long; or each without fail.
  struct Listeners {
    std::map<std::string, std::set<std::string>> nodes;
    bool are_sure = false;
  };
  /// `name`: for people.
  Watchdog(std::string name, std::unique_ptr<GuardWay> way, Listeners listeners);

  /// Tells the stops of the outputs: whenever one of them has changed.
  void tellOutputs(const std::vector<replay::MotionMonitor::Output>& outputs);
  /// The player lives, and these outputs are in motion. Without another beat within
  /// patience(`patience_ns`) they are stopped.
  void beat(const replay::Outputs& moving, std::int64_t patience_ns);
  /// The robot has to stop now. Whatever was in motion: the guard knows.
  void stop() { send({}, patience(0), true, false); }
  /// All is over, and the robot stands.
  void end() { send({}, patience(0), false, true); }

  /// Takes in what it has answered. Before isReady() and whyLost().
  void listen();
  const std::string& name() const { return name_; }
  /// Returns true once it is connected to whoever listens on the outputs, and the link has been
  /// measured.
  bool isReady() const { return is_ready_; }
  /// The reason why it watches no more: a clause. Empty: it does.
  const std::string& whyLost() const { return lost_; }

  /// Returns true if it runs on this machine; after isReady().
  bool isBeside() const { return answer_.is_beside != 0; }
  /// Beside the player it is as patient as is asked for; over a network as was measured, too.
  std::int64_t patience(std::int64_t patience_ns) const;
  /// Returns the longest gap between two beats, as they got there.
  std::int64_t longestGapNs() const { return answer_.longest_gap_us * std::int64_t{1000}; }

 private:
  void send(const replay::Outputs& moving, std::int64_t patience_ns, bool stops, bool ends);
  void sendOutputsIfDue();
  void askAgain();
  bool isHeard() const;
  bool isConnected();
  bool isMeasured();
  void lose(const std::string& reason);

  std::string name_;
  std::unique_ptr<GuardWay> way_;
  Listeners listeners_;
  GuardOutputs outputs_;
  std::uint32_t count_ = 0, first_answered_ = 0;  ///< number of beats
  std::optional<Deadline> resend_at_, connected_by_;
  std::int64_t afar_ns_ = 0;  ///< patience over a network, as measured
  bool is_ready_ = false;
  std::string lost_;
  GuardAnswer answer_;  ///< the latest that was taken in
};

/// Returns the name of the guard on the robot: afterglow_guard, in this node's namespace.
std::string robotGuardName();
/// The name of the watch on ROS 2 (nodes/ros2/): a guard that hears beats over the bridge, and
/// stops what goes that way.
std::string ros2WatchName();
/// The bridges over which what is sent on these topics gets to ROS 2, by topic.
std::map<std::string, std::set<std::string>> ros2Listeners(const RosGraph& graph,
                                                           const std::vector<std::string>& topics);
/// Returns why motion on the topic may not begin: it gets to ROS 2, and no watch runs there. Empty:
/// it may.
std::string whyUnwatched(const RosGraph& graph, const std::string& topic);

/// Said where none runs.
extern const char* const kNoRobotGuard;

/// Guards stop robots, they do not drive them: this node's watchdog, and the guard on the robot.
bool isGuard(const std::string& node);
/// Somebody else: neither this node nor one of its guards.
bool isAnother(const std::string& node);

/// The way to the guard on the robot (nodes/guard/), or to the watch on ROS 2: topics
/// (guard_messages.hpp).
class RobotGuard : public GuardWay {
 public:
  /// Returns true if the guard of that name runs and answers. Takes at most half a second.
  static bool isThere(const RosGraph& graph, const std::string& name = robotGuardName());

  explicit RobotGuard(const std::string& name = robotGuardName());

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

/// Returns the name of this node's watchdog.
std::string guardName();

/// The way to the watchdog beside the player, a process of its own: afterglow_replay_guard.
class GuardProcess : public GuardWay {
 public:
  /// Starts the program, which lies beside the running one. Throws std::runtime_error, one line.
  GuardProcess();
  /// Waits until it has ended, and ends it if that takes too long.
  ~GuardProcess() override;

  void send(const GuardOutputs& outputs) override { socket_->send(outputs); }
  void send(const GuardBeat& beat) override { socket_->send(beat); }
  GuardAnswer answer() override;
  bool isOpen() override { return !socket_->isClosed(); }
  bool isSure() const override { return true; }

 private:
  std::optional<GuardSocket> socket_;  ///< until the process has to end
  pid_t pid_ = -1;
  GuardAnswer answer_;
};

}  // namespace afterglow::nodes
