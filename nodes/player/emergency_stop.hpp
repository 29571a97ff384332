/// \file
/// An emergency stop that is published on a topic: a boolean field of messages of any type, sent
/// periodically, or latched and sent on change.
#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <string>

#include "nodes/player/node_watch.hpp"
#include "nodes/tools/any_message.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "replay/motion/silence_watch.hpp"
#include "replay/motion/stop_field.hpp"
#include "replay/plan/robot_profile.hpp"

namespace afterglow::nodes {

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
  replay::SilenceWatch silence_;
  std::string problem_;         ///< the reason why the robot has to stop now; empty: it has not
  std::size_t publishers_ = 0;  ///< number of connections there were at check()
  bool has_stopped_ = false;
  PublisherWatch living_;
  ros::Subscriber subscriber_;
  CallbackThread thread_;
};

}  // namespace afterglow::nodes
