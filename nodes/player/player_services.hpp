/// \file
/// The services of player_node: what ros2 bag play has, and rosbag play's pause_playback.
#pragma once

#include <afterglow/LastReport.h>
#include <afterglow/PlayBehavior.h>
#include <afterglow/Rehearse.h>
#include <afterglow/ReplayGoal.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "nodes/player/replay_session.hpp"

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

}  // namespace afterglow::nodes
