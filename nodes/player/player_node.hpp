/// \file
/// player_node: replays stored behaviors into the running robot by action (`replay`), with services
/// (those of ros2 bag play, and rosbag play's pause_playback) and a latched ~status.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <afterglow/LastReport.h>
#include <afterglow/PlayBehavior.h>
#include <afterglow/Rehearse.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/ReplayGoal.h>
#include <afterglow/ReplayStatus.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/player/replay_session.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// ~play, ~stop, ~pause, ~resume, ~toggle_paused, ~is_paused, ~set_rate, ~get_rate, ~seek,
/// ~play_next, ~burst, ~pause_playback, ~rehearse, ~last_report. Each answers with what it did, or
/// why it did not; the last two in a thread of their own, so that no stop waits for them. What
/// somebody paused goes on only when all who paused it have resumed it, told apart by the names of
/// their nodes; anybody stops it.
class PlayerServices {
 public:
  struct Player {
    /// Returns the session that is played; empty: there is none.
    std::function<std::shared_ptr<ReplaySession>()> session;
    /// Throws std::runtime_error, one line, for a goal that would be refused.
    std::function<void(const ReplayGoal&)> check;
    std::function<void(const Rehearse::Request&, Rehearse::Response&)> rehearse;
    std::function<void(LastReport::Response&)> last_report;
  };
  PlayerServices(const ros::NodeHandle& private_node, const std::string& action, Player player);
  ~PlayerServices();

 private:
  using Session = std::shared_ptr<ReplaySession>;
  template <typename Service>
  using Command = std::function<std::string(const Session&, const typename Service::Request&,
                                            const std::string& caller)>;

  template <typename Service>
  void serve(const std::string& name, Command<Service> command);
  std::string setPaused(const Session& session, bool pauses, const std::string& caller);
  void needNoOthersPause(const Session& session, const std::string& caller);
  std::set<std::string>& pausersOf(const Session& session);
  bool play(PlayBehavior::Request& request, PlayBehavior::Response& response);

  ros::NodeHandle node_;
  const Player player_;
  ros::Publisher goals_;  ///< publisher to this node's own action
  std::mutex mutex_;
  std::weak_ptr<ReplaySession> paused_;
  std::set<std::string> pausers_;  ///< nodes that paused this session
  std::vector<ros::ServiceServer> servers_;
  ros::CallbackQueue slow_requests_;
  ros::AsyncSpinner slow_thread_{1, &slow_requests_};
};

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
