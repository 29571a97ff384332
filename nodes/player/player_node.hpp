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
#include <string>
#include <vector>

#include "nodes/player/player_services.hpp"
#include "nodes/player/replay_session.hpp"
#include "nodes/player/replay_words.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Private parameters of player_node.
struct PlayerNodeOptions {
  std::string store;                    ///< ~store, as openStore() takes it
  bool allow_motion = false;            ///< ~allow_motion
  double wait_for_subscribers_s = 2.0;  ///< ~wait_for_subscribers
  bool needs_subscribers = false;       ///< ~unheard: "abort"; else "start"
  bool clear_projection = true;         ///< ~clear_projection
  double hold_s = 2.0;                  ///< ~hold: how long the light stays after the end
  double goal_wait_s = 10.0;            ///< ~goal_wait: how long goals may take beyond the end
  double seek_lead_s = 5.0;             ///< ~seek_lead: the arm's time to get to where it goes on
  std::uint32_t queue = 100;            ///< ~queue, of each topic
  bool realtime = true;                 ///< ~realtime: tries SCHED_FIFO
  std::vector<std::string> also;        ///< ~also, a list of topics that are published, too
  std::string rules, limits;            ///< ~rules, ~limits: files (replay_words.hpp)
  replay::ModalityLatency latency_s;    ///< ~latency, a list: ["ar=0.05", "speech=0.2"]
  replay::FailurePolicy on_failure;     ///< ~on_failure, a list: ["speech=stop"]
  std::string report_folder;            ///< ~report_folder: for each replay's (report_files.hpp)
  BodyOptions body;                     ///< as body_gate.hpp and replayed_base.hpp name them
  /// ~anchor (a list of world, body, /topic=world, /topic=body), ~anchor_frame (map)
  replay::AnchorSettings anchors;

  /// Throws std::runtime_error, one line, for a value that is none.
  static PlayerNodeOptions read(const ros::NodeHandle& private_node);
};

/// One replay at a time; a new goal stops the one before, as actionlib's simple server has it.
class PlayerNode {
 public:
  explicit PlayerNode(const PlayerNodeOptions& options);
  /// As close().
  ~PlayerNode();

  /// Stops what is played and waits until the robot has been told; refuses further goals.
  void close(const std::string& reason);

 private:
  using Server = actionlib::SimpleActionServer<ReplayAction>;
  void onGoal(const ReplayGoalConstPtr& goal);
  ReplayRequest requestOf(const ReplayGoal& goal) const;
  replay::PlanOptions planOf(const ReplayGoal& goal) const;
  replay::PlayOptions playOf(const ReplayGoal& goal) const;
  void play(const ReplayRequest& request);
  void keepReport(const replay::PlayReport& report) const;
  void onTimer();
  std::shared_ptr<ReplaySession> session() const;
  ReplayStatus status() const;
  void show(std::shared_ptr<ReplaySession> session, const std::string& message);
  void publishStatus(const std::string& message);
  void setSession(std::shared_ptr<ReplaySession> session);

  const PlayerNodeOptions options_;
  const ReplayRules rules_;
  const replay::MotionLimits limits_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<ReplaySession> session_;  ///< shared with whoever commands it just now
  bool is_closing_ = false;

  std::mutex status_mutex_;  ///< taken before mutex_: what ~status says follows what is so
  std::uint8_t shown_state_ = ReplayStatus::IDLE;
  bool is_status_due_ = false;  ///< every second time

  ros::NodeHandle node_, private_node_{"~"};
  ros::Publisher status_;
  ros::WallTimer timer_;
  Server server_;
  std::unique_ptr<PlayerServices> services_;
};

}  // namespace afterglow::nodes
