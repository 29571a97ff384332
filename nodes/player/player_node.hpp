/// \file
/// player_node: replays stored behaviors into the running robot by action (`replay`), with services
/// (player_services.hpp) and a latched ~status.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/ReplayStatus.h>
#include <ros/ros.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "nodes/player/player_services.hpp"
#include "nodes/player/replay_session.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Private parameters of player_node.
struct PlayerNodeOptions {
  std::string store;          ///< ~store, as openStore() takes it
  std::string report_folder;  ///< ~report_folder: for each replay's (replay_page.hpp)
  ReplayRequest replays;      ///< settings for all: the options of play_options.hpp, by name

  /// Throws std::runtime_error, one line, for a value that is none.
  static PlayerNodeOptions read(const ros::NodeHandle& private_node);
};

/// A player of one replay at a time; a new goal stops the one before, as actionlib's simple server
/// has it.
class PlayerNode {
 public:
  explicit PlayerNode(const PlayerNodeOptions& options);
  /// Closes as close() does.
  ~PlayerNode();

  /// Stops what is played and waits until the robot has been told; refuses further goals.
  void close(const std::string& reason);

 private:
  using Server = actionlib::SimpleActionServer<ReplayAction>;
  void onGoal(const ReplayGoalConstPtr& goal);
  ReplayRequest requestOf(const ReplayGoal& goal) const;
  void play(const ReplayRequest& request);
  void keepReport(const replay::PlayReport& report);
  void rehearse(const Rehearse::Request& asked, Rehearse::Response& told) const;
  void tellLastReport(LastReport::Response& told) const;
  void onTimer();
  std::shared_ptr<ReplaySession> session() const;
  bool isClosing() const;
  ReplayStatus status() const;
  void show(std::shared_ptr<ReplaySession> session, const std::string& message);
  void publishStatus(const std::string& message);
  void setSession(std::shared_ptr<ReplaySession> session);

  const PlayerNodeOptions options_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<ReplaySession> session_;  ///< shared with whoever commands it just now
  std::optional<replay::PlayReport> last_report_;
  bool is_closing_ = false;

  std::mutex status_mutex_;  ///< taken before mutex_: what ~status says follows what is so
  std::uint8_t shown_state_ = ReplayStatus::IDLE;
  bool is_status_due_ = false;  ///< true every second time

  ros::NodeHandle node_, private_node_{"~"};
  ros::Publisher status_;
  ros::WallTimer timer_;
  Server server_;
  std::unique_ptr<PlayerServices> services_;
};

}  // namespace afterglow::nodes
