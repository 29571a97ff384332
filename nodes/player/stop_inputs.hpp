/// \file
/// The ways by which people stop a replay in motion: an emergency stop, a button that has to be
/// held, and driving the robot themselves.
///
/// The watch over the ROS master and over the nodes that publish a topic, while the robot moves.
#pragma once

#include <sensor_msgs/Joy.h>

#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/player/take_over.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/motion/silence_monitor.hpp"
#include "replay/motion/stops/operator_stops.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/plan/robot_profile.hpp"

namespace afterglow::nodes {

/// Connections outlive the master, but whoever would stop the robot by a new one does not get
/// through: without it nothing moves. Asks four times a second; one answer may be lost.
class MasterMonitor {
 public:
  /// Takes `on_lost`, which is called once, in a thread of its own: 0.75 s after a master's end at
  /// most, 2.5 s after it has begun to hang.
  explicit MasterMonitor(std::function<void(const std::string& reason)> on_lost);

 private:
  void look();

  const std::function<void(const std::string&)> on_lost_;
  MasterLink master_;
  int missed_ = 0;  ///< number of misses in a row
  CallbackThread thread_;
};

/// Watches whether nodes still live. A connection does not tell: roscpp keeps that to a node that
/// was killed, and a node that hangs keeps its own. Asks them again and again, in a thread of its
/// own: one that was killed or hangs is noticed within 1.5 s.
class PublisherMonitor {
 public:
  /// Takes `on_gone`: a node has not answered twice; said once.
  explicit PublisherMonitor(std::function<void(const std::string& node)> on_gone);

  /// Makes this node one that has to answer from now on. Any thread; a node that is known already
  /// is left alone.
  void add(const std::string& node);

 private:
  struct Known {
    std::optional<NodeAddress> address;  ///< asked of the master once, which may die
    int unanswered = 0;
  };

  void look();
  bool isGone(const std::string& node);

  const std::function<void(const std::string&)> on_gone_;
  std::mutex mutex_;
  std::set<std::string> nodes_;
  std::map<std::string, Known> known_;  ///< look()'s
  bool has_told_ = false;               ///< likewise
  CallbackThread thread_;
};

/// Options of the emergency stop; without a topic there is none; without a field it is the only
/// boolean that the messages have.
struct EmergencyStopOptions : replay::RobotProfile::EmergencyStop {
  /// s; above 0 the topic has to be repeated at least this often; 0: by its period, if it has one.
  double longest_silence_s = 0;
  std::string profile;  ///< the robot's, which names it; empty: an option does

  /// "/robot_state:runstopped", "/power_board/state:!run_stop", "none". Sets all but the silence.
  /// Throws std::invalid_argument.
  void set(const std::string& text);
  /// The same text.
  std::string text() const;
};

/// Listens in a thread of its own.
class EmergencyStop {
 public:
  /// Takes `on_stop`, which is called once, with the reason, when the robot has to stop: the stop
  /// is pressed, its publisher is gone, it is silent or cannot be read.
  EmergencyStop(const EmergencyStopOptions& options,
                std::function<void(const std::string& reason)> on_stop);

  /// Waits for the first message, and a moment for more, by which the period is known. Throws
  /// std::runtime_error, one line, if the robot may not move.
  void check();

 private:
  void waitForNews();
  void onMessage(const AnyMessage& event);
  void onTimer();
  void stop(const std::string& reason);
  std::string named() const;

  const EmergencyStopOptions options_;
  const std::function<void(const std::string&)> on_stop_;
  std::mutex mutex_;
  replay::StopField field_;
  replay::SilenceMonitor silence_;
  std::string problem_;         ///< the reason why the robot has to stop now; empty: it has not
  std::size_t publishers_ = 0;  ///< number of connections there were at check()
  bool has_stopped_ = false;
  PublisherMonitor living_;
  ros::Subscriber subscriber_;
  CallbackThread thread_;
};

/// The button of a joystick (sensor_msgs/Joy) that has to be held for the robot to move.
struct HoldButtonOptions {
  std::string topic;  ///< empty: the robot moves without
  std::size_t button = 0;
  double patience_s = 60;  ///< time for somebody to press it

  /// "/joy:10". Throws std::invalid_argument.
  void set(const std::string& text);
};

/// Listens in a thread of its own.
class HoldButton {
 public:
  /// Takes `on_change`, which that thread calls when the hold begins and ends: released, or silent.
  HoldButton(const HoldButtonOptions& options, std::function<void(bool is_held)> on_change);

  bool isHeld();
  /// Says what to press, and returns when it has been held for half a second, which shows that its
  /// joystick repeats itself. Throws std::runtime_error, one line, if nobody presses it in time,
  /// or the joystick falls silent.
  void waitUntilHeld(const std::function<bool()>& is_stopped);

 private:
  using Event = ros::MessageEvent<const sensor_msgs::Joy>;
  void onJoy(const Event& event);
  void tellChange();
  bool isHeldSteadily();
  std::string whyNot();

  const HoldButtonOptions options_;
  const std::string named_;  ///< "button 10 of /joy"
  const std::function<void(bool)> on_change_;
  std::mutex mutex_;
  replay::HoldToRun hold_;
  bool has_button_ = true;  ///< so have the messages
  bool was_held_ = false;   ///< state that on_change_ was told
  CallbackThread thread_;
};

/// ROS parameters of the same meaning are named in brackets.
struct StopOptions {
  EmergencyStopOptions emergency_stop;  ///< [~estop_topic, ~estop_longest_silence]
  HoldButtonOptions hold_button;        ///< [~hold_to_run]
};

/// Returns the topic of the base's velocities: the topic that was named, the profile's, or the only
/// velocity topic that is played; empty: it is not known which, or the base is not driven.
std::string baseTopic(const replay::PlayPlan& plan, const std::string& named,
                      const std::string& of_profile);

/// The inputs that stop one replay.
class StopInputs {
 public:
  /// Any thread. `stop`: for good. `halt`: until it is called with false.
  struct Actions {
    std::function<void(const std::string& reason)> stop;
    std::function<void(bool halts)> halt;
  };
  /// The take-over, which has to know what is sent from the first message on, outlives it.
  StopInputs(const StopOptions& options, TakeOver& take_over, Actions actions);
  ~StopInputs();

  /// Checks before anything moves. Throws std::runtime_error, one line, if the robot may not.
  void check();
  /// Waits for the button, if there is one; throws as HoldButton::waitUntilHeld().
  void waitUntilHeld(const std::function<bool()>& is_stopped);
  /// Returns true if it is held, or need not be.
  bool isHeld() { return !hold_button_ || hold_button_->isHeld(); }
  /// Returns notes for the report.
  std::vector<std::string> notes() const;

 private:
  const StopOptions options_;
  TakeOver& take_over_;
  const Actions actions_;
  std::optional<EmergencyStop> emergency_stop_;
  std::optional<HoldButton> hold_button_;
};

}  // namespace afterglow::nodes
