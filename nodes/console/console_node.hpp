/// \file
/// The console beside a running robot (console_node): the state of the robot as ROS tells it now,
/// and requests to player_node and recorder_node.
///
/// /api/events: the state, told to all pages alike.
#pragma once

#include <ros/ros.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "nodes/console/heard_robot.hpp"
#include "nodes/console/http_message.hpp"
#include "nodes/console/robot_links.hpp"
#include "nodes/console/running_replay.hpp"
#include "replay/clock/worker_thread.hpp"

namespace afterglow::nodes {

/// Any thread. A thread of its own asks for the state five times a second, and tells it when it is
/// another one; whoever comes is told at once.
class ConsoleEvents {
 public:
  static constexpr std::chrono::milliseconds kPeriod{200};
  static constexpr std::size_t kMostPages = 16;

  struct Sources {
    std::function<std::string()> state;  ///< JSON in one line
    std::function<std::size_t()> total;  ///< behaviors in the store
  };
  explicit ConsoleEvents(Sources sources);
  /// Ends all streams.
  ~ConsoleEvents();

  /// A page that listens. Throws HttpError 503 where too many do.
  HttpResponse open(const std::string& session);
  /// Returns true if a page of this session listens; false for an empty one.
  bool isListening(const std::string& session) const;

 private:
  struct Page {
    std::string session;
    std::shared_ptr<EventStream> stream;
  };
  void look();
  void tell(const std::string& text);
  void close(std::uint64_t page);

  const Sources sources_;
  mutable std::mutex mutex_;
  std::map<std::uint64_t, Page> pages_;
  std::uint64_t pages_ever_ = 0;
  std::string newest_;  ///< the event of the state
  std::size_t total_ = 0;  ///< number that was told last
  int silent_ = 0;         ///< periods without news
  replay::RepeatingThread thread_{kPeriod, [this] { look(); }};
};

struct ConsoleNodeOptions {
  std::string store;
  std::string player = "player_node", recorder = "recorder_node";
  std::string calibrator = "calibrator_node";
  std::string projector = "projector/image";  ///< sensor_msgs/Image
  std::string camera = "camera/image_raw";    ///< sensor_msgs/Image, the calibrator's
};

/// The tokens that a dry run gives: each lets one request move the robot, once, for a minute. Any
/// thread. Times are given.
class MotionTokens {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::seconds kLifetime{60};
  static constexpr std::size_t kMost = 64;  ///< the oldest go

  /// The findings of a dry run of the request of this key.
  struct Found {
    std::string key;
    bool moves = false;
  };

  std::string make(Found found, Time now);
  /// Takes it: a second time there is none. Empty: it is unknown, or too old.
  std::optional<Found> take(const std::string& token, Time now);

 private:
  struct Made {
    Found found;
    Time at;
  };
  void forgetOld(Time now);

  std::mutex mutex_;
  std::map<std::string, Made> made_;
};

/// Answers what ConsoleApi leaves to a robot. After ros::start; with spinning threads.
class ConsoleNode {
 public:
  /// `total`: behaviors in the store. Throws std::runtime_error, one line.
  ConsoleNode(const ConsoleNodeOptions& options, std::function<std::size_t()> total);
  /// Stops a replay that was started here. To be called once the server has been stopped.
  void close() { replay_.close(); }
  ~ConsoleNode() { close(); }  // before what it asks goes

  /// Answers for ConsoleApi::setRobot(), at once or when the player has answered; throws HttpError.
  void answer(const HttpRequest& request, const Respond& respond);

 private:
  using Work = std::function<HttpResponse()>;
  std::string state() const;
  void later(replay::TaskThread& thread, const Respond& respond, Work work);
  HttpResponse stop();
  HttpResponse report() const;
  HttpResponse reportPage() const;
  HttpResponse hold(const nlohmann::json& asked);
  HttpResponse dryRun(const nlohmann::json& asked);
  HttpResponse play(const nlohmann::json& asked, std::uint64_t stops_before);
  HttpResponse record(const nlohmann::json& asked) const;
  HttpResponse endRecording(const nlohmann::json& asked) const;
  void answerPost(const HttpRequest& request, const Respond& respond);

  const ConsoleNodeOptions options_;
  PlayerLink player_;
  CalibratorLink calibrator_;
  HeardDiagnostics diagnostics_;
  ProjectedImage projected_, camera_;
  MotionTokens tokens_;
  DeadManSwitch dead_man_switch_;
  RunningReplay replay_;
  ConsoleEvents events_;
  replay::TaskThread rehearsals_, commands_;  ///< listen for seconds; ask the player
};

}  // namespace afterglow::nodes
