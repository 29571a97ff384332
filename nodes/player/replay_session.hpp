/// \file
/// One replay into the running robot, from finding the behavior to the report: what player_node and
/// `afterglow play` share.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "nodes/player/ros_sink.hpp"
#include "replay/play/clock.hpp"
#include "replay/play/player.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct ReplayRequest {
  std::int64_t behavior_id = 0;  ///< 0: the newest called `name`
  std::string name;
  std::string only;           ///< "body,ar,speech", any of them; empty: all
  bool allow_motion = false;  ///< without it a replay that would move the body is refused
  double wait_for_subscribers_s = 2.0;
  replay::PlayOptions options;
};

/// The behavior asked for. Throws std::runtime_error, one line, if there is none.
replay::Behavior findRequested(const replay::Store& store, const ReplayRequest& request);

/// Any thread may stop, pause, resume and look; run() once.
class ReplaySession {
 public:
  /// Finds and plans; needs no master. Throws, with one line: unknown behavior or modality, nothing
  /// to play, a rate other than 1 for the body.
  ReplaySession(const replay::Store& store, const ReplayRequest& request);

  const replay::PlayPlan& plan() const { return plan_; }
  /// Throws std::runtime_error, one line, if the replay would move the robot and may not.
  void checkMotionAllowed() const;

  /// Plays and cleans up. Throws std::runtime_error, before anything is advertised, if it would
  /// move the robot and may not, or if no master answers within 2 s. Stops, before or while it
  /// plays, when another node sends velocities on a topic that is played.
  replay::PlayReport run();
  void stop(const std::string& reason);
  void pause();
  void resume();
  replay::PlayProgress progress() const;

 private:
  replay::PlayReport play(RosSink& sink);
  bool isStopped() const;

  const replay::Store& store_;
  const ReplayRequest request_;
  const replay::PlayPlan plan_;
  replay::SteadyClock clock_;
  mutable std::mutex mutex_;
  std::unique_ptr<replay::Player> player_;  ///< while run() plays
  std::optional<std::string> stop_reason_;
  bool is_paused_ = false;
};

}  // namespace afterglow::nodes
