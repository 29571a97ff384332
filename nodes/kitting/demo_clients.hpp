/// \file
/// The demo's calls to recorder_node, player_node and observer_node. Every method may throw
/// TaskError, one line that names who did not do what; all need a running spinner.
#pragma once

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

class PlayerClient {
 public:
  PlayerClient();
  void waitUntilReady(double seconds);
  /// Replays the newest behavior of that name. `on_position` is called often with the seconds into
  /// the behavior, once the player has begun.
  ReplayResult replay(const std::string& name, double duration_s,
                      const std::function<void(double)>& on_position);

 private:
  ActionClient client_;
  std::mutex mutex_;
  std::optional<double> position_s_;  ///< as last told: it stands while the replay waits
  std::optional<ReplayResult> result_;
  ros::Subscriber feedback_, results_;
};

/// What a bystander sees, and the film of it.
class Bystander {
 public:
  Bystander();
  void waitUntilReady(double seconds);
  /// From which of the view file's other places; empty: from the usual one.
  void look(const std::string& place);
  void caption(const std::string& tag, const std::string& text);
  /// A human asks the robot: shown and heard in the film.
  void asks(const std::string& question);
  /// Saves the next image as NAME.png, the projector's as NAME_projector.png.
  void takeImage(const std::string& name);
  /// Ends the film; it is in place then. Its first image's ROS time.
  std::int64_t finishFilm();

 private:
  ros::NodeHandle node_{"/observer_node"};
  ros::Publisher look_, caption_, asked_, key_frame_;
};

/// Whoever died on the way took part of the demo with them.
void expectAllNodes();

}  // namespace afterglow::nodes
