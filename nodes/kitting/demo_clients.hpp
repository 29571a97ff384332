/// \file
/// The demo's calls to recorder_node and player_node. Every method may throw TaskError, one line
/// that names who did not do what; all need a running spinner.
#pragma once

#include <actionlib/client/simple_action_client.h>
#include <afterglow/RecordBehaviorAction.h>
#include <afterglow/ReplayAction.h>
#include <ros/ros.h>

#include <functional>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// What to record of a behavior.
struct DemoRecording {
  std::string name, tree_path;
  std::vector<std::string> topics;
};

class DemoRecorder {
 public:
  DemoRecorder();
  void waitUntilReady(double seconds);
  /// Runs `behavior` between the recorder's "everything is subscribed" and its end, with outcome
  /// "success"; with "failure" if it throws, which is thrown on.
  RecordBehaviorResult record(const DemoRecording& request,
                              const std::function<void()>& behavior);

 private:
  void stop(std::int64_t id, const std::string& outcome);

  ros::NodeHandle node_;
  actionlib::SimpleActionClient<RecordBehaviorAction> client_;
  ros::ServiceClient stop_;
};

class PlayerClient {
 public:
  PlayerClient();
  void waitUntilReady(double seconds);
  /// Replays the newest behavior of that name. `on_position` is called some fifty times a second
  /// with the seconds into the behavior, once the player has begun.
  ReplayResult replay(const std::string& name, double duration_s,
                      const std::function<void(double)>& on_position);

 private:
  actionlib::SimpleActionClient<ReplayAction> client_;
};

}  // namespace afterglow::nodes
