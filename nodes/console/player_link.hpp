/// \file
/// What console_node hears of player_node and asks of it: by its action, its services and its
/// ~status, never around them.
#pragma once

#include <actionlib_msgs/GoalID.h>
#include <afterglow/ReplayActionFeedback.h>
#include <afterglow/ReplayActionResult.h>
#include <afterglow/ReplayStatus.h>
#include <ros/ros.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// Any thread.
class PlayerLink {
 public:
  /// Of a goal that was sent here.
  struct Course {
    bool is_begun = false;  ///< messages go out
    bool is_ended = false;
    bool is_completed = false;
    std::string words;   ///< at its end: why
    std::string report;  ///< JSON; empty: it was refused
  };

  /// A node's name, "/player_node"; its action is `replay` in the same namespace.
  explicit PlayerLink(const std::string& player);

  const std::string& player() const { return player_; }
  /// Whether it publishes ~status and hears goals and cancels.
  bool isThere() const;
  /// Empty: it is not there, or has said nothing yet.
  std::optional<ReplayStatus> status() const;

  /// A goal of a name that no other has, to be sent. What was known of others is forgotten.
  std::string newGoal();
  void send(const std::string& goal, std::int64_t behavior,
            const std::vector<std::string>& options);
  Course course(const std::string& goal) const;
  /// Waits until the goal has begun or ended, or so long.
  Course await(const std::string& goal, std::chrono::milliseconds patience);
  /// Of all goals, this one too if it has not come yet. At once. False: nobody hears it.
  bool cancel(const std::string& goal);

  // Services; they wait for the answer. They throw HttpError with the player's own words.
  void trigger(const std::string& service) const;
  void setRate(double rate) const;
  void seek(double seconds) const;

 private:
  template <typename Service>
  void call(const std::string& name, const typename Service::Request& request) const;
  void onStatus(const ReplayStatus& status);
  void onFeedback(const ReplayActionFeedback& feedback);
  void onResult(const ReplayActionResult& result);

  const std::string player_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<ReplayStatus> newest_;
  std::map<std::string, Course> courses_;  ///< by goal
  std::uint64_t goals_sent_ = 0;
  ros::NodeHandle node_;
  ros::Publisher goals_, cancels_;
  ros::Subscriber status_, feedback_, results_;
};

}  // namespace afterglow::nodes
