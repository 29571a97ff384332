/// \file
/// recorder_node: records behaviors by action (`record_behavior`) and by service (~start_recording,
/// ~stop_recording) into the store.
#pragma once

#include <actionlib/server/action_server.h>
#include <afterglow/RecordBehaviorAction.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <ros/ros.h>

#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/recorder/topic_listener.hpp"
#include "replay/record/recorder.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Private parameters of recorder_node.
struct RecorderNodeOptions {
  std::string store;  ///< ~store, as openStore() takes it
  std::string robot;  ///< ~robot
  /// ~context_topics: recorded along with every behavior.
  std::vector<std::string> context_topics = {"/tf", "/tf_static", "/joint_states", "/odom"};
  double connect_timeout_s = 2.0;  ///< ~connect_timeout: waits no longer for publishers
  int queue_megabytes = 256;       ///< ~queue_megabytes: what may wait for the store

  /// Throws std::runtime_error naming the parameter that is wrong.
  static RecorderNodeOptions read(const ros::NodeHandle& private_node);
};

/// Any number of behaviors at once. A behavior counts as started, by first feedback or service
/// return, when every publisher that was announced on its topics is known to send here; one that
/// does not in time is named in a warning. Topics without publishers are listened to all the same.
class RecorderNode {
 public:
  /// Throws StoreError.
  explicit RecorderNode(const RecorderNodeOptions& options);
  /// Ends what still runs, as endAll("interrupted").
  ~RecorderNode();

  void endAll(const std::string& outcome);

 private:
  using Server = actionlib::ActionServer<RecordBehaviorAction>;
  using Goal = Server::GoalHandle;
  struct Running {
    std::vector<std::string> topics;
    std::optional<Goal> goal;
  };
  struct Ended {
    replay::RecordedCounts counts;
    std::string problem;  ///< why the recording is not whole; empty if it is
  };

  bool onStart(StartRecording::Request& request, StartRecording::Response& response);
  bool onStop(StopRecording::Request& request, StopRecording::Response& response);
  void onGoal(Goal goal);
  void onCancel(Goal goal);
  void onTimer();

  std::int64_t start(const replay::Behavior& behavior, std::optional<Goal> goal,
                     std::string* warning);
  void startGoal(Goal goal);
  std::optional<Ended> stop(std::int64_t id, const std::string& outcome);
  void finishGoal(Goal goal, std::int64_t id, const std::string& outcome, const Ended& ended);
  std::optional<std::int64_t> behaviorOf(const Goal& goal) const;
  std::vector<std::int64_t> runningIds() const;
  void later(std::function<void()> job);

  const RecorderNodeOptions options_;
  std::unique_ptr<replay::Store> store_;
  replay::Recorder recorder_;
  TopicListener listener_;

  mutable std::mutex mutex_;  ///< never held while calling actionlib, which locks around callbacks
  std::map<std::int64_t, Running> running_;
  std::set<std::string> canceled_;  ///< goals canceled before they had started
  std::vector<std::future<void>> jobs_;
  bool is_closing_ = false;

  ros::NodeHandle node_, private_node_{"~"};
  Server server_;
  ros::ServiceServer start_service_, stop_service_;
  ros::WallTimer timer_;
};

}  // namespace afterglow::nodes
