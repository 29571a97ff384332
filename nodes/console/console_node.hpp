/// \file
/// console_node: the console beside a running robot. What it adds to `afterglow console`: what ROS
/// says now, and what is asked of player_node and recorder_node.
#pragma once

#include <ros/ros.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "nodes/console/calibrator_link.hpp"
#include "nodes/console/console_events.hpp"
#include "nodes/console/farewell.hpp"
#include "nodes/console/heard_diagnostics.hpp"
#include "nodes/console/http_message.hpp"
#include "nodes/console/motion_tokens.hpp"
#include "nodes/console/player_link.hpp"
#include "nodes/console/projected_image.hpp"
#include "nodes/console/replay_keeper.hpp"
#include "replay/clock/worker_thread.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct ConsoleNodeOptions {
  std::string store;
  std::string player = "player_node", recorder = "recorder_node";
  std::string calibrator = "calibrator_node";
  std::string projector = "projector/image";  ///< sensor_msgs/Image
};

/// Answers what ConsoleApi leaves to a robot. After ros::start; with spinning threads.
class ConsoleNode {
 public:
  /// `store`: the one of the options. `total`: behaviors in it. Throws std::runtime_error, one line.
  ConsoleNode(const ConsoleNodeOptions& options, const replay::Store& store,
              std::function<std::size_t()> total);
  /// Stops a replay that was started here. The server has to have been stopped.
  ~ConsoleNode();

  /// For ConsoleApi::setRobot(). At once, or once the player has answered; throws HttpError.
  void answer(const HttpRequest& request, const Respond& respond);

 private:
  using Work = std::function<HttpResponse()>;
  std::string state() const;
  void later(replay::TaskThread& thread, const Respond& respond, Work work);
  HttpResponse stop();
  HttpResponse report() const;
  HttpResponse hold(const nlohmann::json& asked);
  HttpResponse dryRun(const nlohmann::json& asked);
  HttpResponse play(const nlohmann::json& asked, std::uint64_t stops_before);
  HttpResponse record(const nlohmann::json& asked) const;
  HttpResponse endRecording(const nlohmann::json& asked) const;
  void answerPost(const HttpRequest& request, const Respond& respond);

  const ConsoleNodeOptions options_;
  const replay::Store& store_;
  std::atomic<bool> is_ending_{false};
  PlayerLink player_;
  CalibratorLink calibrator_;
  HeardDiagnostics diagnostics_;
  ProjectedImage projected_;
  MotionTokens tokens_;
  Farewell farewell_;
  ReplayKeeper keeper_;
  ConsoleEvents events_;
  replay::TaskThread rehearsals_, commands_;  ///< what listens for seconds; what the player answers
};

}  // namespace afterglow::nodes
