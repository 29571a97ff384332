/// \file
/// recorder_node: records behaviors by action (`record_behavior`, `mongodb_logger`) and by service
/// (~start_recording, ~stop_recording) into the store; says how it fares on /diagnostics.
#pragma once

#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <diagnostic_msgs/DiagnosticStatus.h>
#include <ros/ros.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/recorder/recorder_options.hpp"
#include "nodes/recorder/recording_actions.hpp"
#include "nodes/recorder/recording_manager.hpp"
#include "replay/record/disk_guard.hpp"
#include "replay/record/recorder.hpp"
#include "replay/store/open/recorder_store.hpp"

namespace afterglow::nodes {

class RecorderNode {
 public:
  /// Throws StoreError.
  explicit RecorderNode(const RecorderNodeOptions& options);
  ~RecorderNode();

  /// Accepts no requests any more and ends running recordings as interrupted.
  void close();
  /// Waits a while, after close(), until the store's server has everything. One line on what it has
  /// not; empty if there is nothing.
  std::string sendRest();

 private:
  bool onStart(StartRecording::Request& request, StartRecording::Response& response);
  bool onStop(StopRecording::Request& request, StopRecording::Response& response);
  void every(double period_s, const std::function<void()>& work);
  void everySecond();
  void publishDiagnostics();

  const RecorderNodeOptions options_;
  ros::NodeHandle node_, private_node_{"~"};
  replay::RecorderStore store_;
  StoreSpace space_;
  RecordingManager manager_;
  GoalRecorder<RecordBehaviorAction, RecordBehaviorTranslation> behaviors_;
  /// Null if it is not to be served.
  std::unique_ptr<GoalRecorder<mongodb::MongoDBLoggerAction, MongoDBLoggerTranslation>> logger_;
  replay::RecorderLoad load_before_;
  ros::SteadyTime told_at_ = ros::SteadyTime::now();
  ros::Publisher diagnostics_;
  ros::ServiceServer start_service_, stop_service_;
  std::vector<ros::WallTimer> timers_;
};

struct RecorderState {
  std::string node;   ///< node without leading slash
  std::string store;  ///< URI of the store
  std::size_t running = 0;
  std::map<std::string, std::uint64_t> named;  ///< RecordingManager::namedCounts()
  replay::RecorderLoad load, load_before;  ///< now, and `seconds` ago
  double seconds = 1;
  std::size_t queue_bytes = 0;  ///< bytes that may wait
  replay::DiskState disk;
  std::optional<std::string> failure;
  std::optional<replay::SendStatus> server;
};

/// ERROR: nothing can be recorded. WARN: messages were dropped since the last time, the queue is
/// half full, the disk is nearly, the server is away or refuses something.
diagnostic_msgs::DiagnosticStatus toDiagnostics(const RecorderState& state);

}  // namespace afterglow::nodes
