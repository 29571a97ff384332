/// \file
/// The console's links to player_node, by its action, its services and its ~status, never around
/// them, and to calibrator_node, whose state they hear and which they ask for its steps.
#pragma once

#include <actionlib_msgs/GoalID.h>
#include <afterglow/LastReport.h>
#include <afterglow/Rehearse.h>
#include <afterglow/ReplayActionFeedback.h>
#include <afterglow/ReplayActionResult.h>
#include <afterglow/ReplayStatus.h>
#include <ros/ros.h>
#include <std_msgs/String.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// A page's request to replay a behavior.
struct PlayRequest {
  std::int64_t behavior = 0;
  std::string only;  ///< "ar,speech"; empty: all
  double rate = 1;
  double start = 0;  ///< seconds into the behavior
  bool is_looping = false;

  /// Returns true if its words alone ask for nothing but light and speech.
  bool isWithoutBody() const;
  /// Returns the options of a goal (play_options.hpp).
  std::vector<std::string> options() const;
  /// Returns the same text for the same request.
  std::string key() const;
};

/// Reads {"behavior": ID, "only":, "rate":, "start":, "loop":}. Throws HttpError 400 for anything
/// else.
PlayRequest readPlayRequest(const nlohmann::json& asked);

/// Any thread.
class PlayerLink {
 public:
  /// The course of a goal that was sent here.
  struct Course {
    bool is_begun = false;  ///< messages go out
    bool is_ended = false;
    bool is_completed = false;
    std::string words;   ///< reason of its end
    std::string report;  ///< JSON; empty: it was refused
  };

  /// A node's name, "/player_node"; its action is `replay` in the same namespace.
  explicit PlayerLink(const std::string& player);

  const std::string& player() const { return player_; }
  /// Returns true if it publishes ~status and hears goals and cancels.
  bool isThere() const;
  /// Empty: it is not there, or has said nothing yet.
  std::optional<ReplayStatus> status() const;

  /// A goal of a name that no other has, to be sent. What was known of others is forgotten.
  std::string newGoal();
  void send(const std::string& goal, const PlayRequest& request);
  Course course(const std::string& goal) const;
  /// Waits until the goal has begun or ended, or so long.
  Course await(const std::string& goal, std::chrono::milliseconds patience);
  /// Cancels all goals at once, this one too if it has not come yet. False: nobody hears it.
  bool cancel(const std::string& goal);

  // Services; they wait for the answer. They throw HttpError with the player's own words.
  void trigger(const std::string& service) const;
  void setRate(double rate) const;
  void seek(double seconds) const;
  // These give the player's answer, a refusal too. They throw HttpError if there is none.
  /// Takes some seconds.
  Rehearse::Response rehearse(const PlayRequest& request) const;
  LastReport::Response lastReport() const;

 private:
  template <typename Service>
  typename Service::Response ask(const std::string& name,
                                 const typename Service::Request& request) const;
  template <typename Service>
  void call(const std::string& name, const typename Service::Request& request) const;
  void onStatus(const ReplayStatus& status);
  void onFeedback(const ReplayActionFeedback& feedback);
  void onResult(const ReplayActionResult& result);

  const std::string player_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<ReplayStatus> newest_;
  std::map<std::string, Course> courses_;  ///< courses by goal
  std::uint64_t goals_sent_ = 0;
  ros::NodeHandle node_;
  ros::Publisher goals_, cancels_;
  ros::Subscriber status_, feedback_, results_;
};

/// Any thread.
class CalibratorLink {
 public:
  static constexpr std::size_t kMostSaid = 8;

  /// A node's name, "/calibrator_node".
  explicit CalibratorLink(const std::string& calibrator);

  /// Returns ~status and `said`: the last lines of its ~guidance, the newest first. Null: it is not
  /// there, or has said nothing yet.
  nlohmann::ordered_json state() const;

  /// Returns true if trigger() knows it: start, stop, take, solve, discard_last.
  static bool isCommand(const std::string& name);
  /// Waits for the answer, and returns its words. Throws HttpError with the calibrator's own.
  std::string trigger(const std::string& command) const;

 private:
  void onStatus(const std_msgs::String& status);
  void onGuidance(const std_msgs::String& guidance);

  const std::string calibrator_;
  mutable std::mutex mutex_;
  nlohmann::ordered_json status_;
  std::deque<std::string> said_;
  ros::NodeHandle node_;
  ros::Subscriber statuses_, guidance_;
};

}  // namespace afterglow::nodes
