/// \file
/// The demo's calls to recorder_node and ask_node. Every method may throw
/// TaskError, one line that names who did not do what; all need a running spinner.
#pragma once

#include <afterglow/AskActionResult.h>
#include <afterglow/ReplayActionFeedback.h>
#include <afterglow/ReplayActionResult.h>
#include <afterglow/StopRecording.h>
#include <ros/ros.h>

#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "nodes/kitting/action_client.hpp"

namespace afterglow::nodes {

/// Runs `behavior` between the recorder's "everything is subscribed" and its end, with outcome
/// "success"; with "failure" if it throws, which is thrown on.
StopRecordingResponse recordBehavior(const std::string& name,
                                     const std::vector<std::string>& topics,
                                     const std::function<void()>& behavior);

/// Asks the robot as a person does, by ask_node, and watches how player_node answers.
class AskClient {
 public:
  AskClient();
  void waitUntilReady(double seconds);
  /// The replay that answered, of a behavior of so many seconds, with its motion: another answer is
  /// an error. `on_position` is called often with the seconds into the behavior, once the player
  /// has begun.
  ReplayResult ask(const std::string& question, double duration_s,
                   const std::function<void(double)>& on_position);

 private:
  void forget();
  bool isAnswered(const std::function<void(double)>& on_position);

  ActionClient client_;
  std::mutex mutex_;
  std::optional<double> position_s_;  ///< position told last: it stands while the replay waits
  std::optional<AskResult> answer_;
  std::optional<ReplayActionResult> replay_;
  ros::Subscriber feedback_, answers_, replays_;
};

/// Whoever died on the way took part of the demo with them.
void expectAllNodes();

}  // namespace afterglow::nodes
