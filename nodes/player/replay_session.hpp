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
#include <vector>

#include "nodes/player/anchor_broadcast.hpp"
#include "nodes/player/body_gate.hpp"
#include "nodes/player/rate_control.hpp"
#include "nodes/player/ros_sink.hpp"
#include "replay/play/anchoring.hpp"
#include "replay/play/clock.hpp"
#include "replay/play/followed_clock.hpp"
#include "replay/play/motion_limits.hpp"
#include "replay/play/player.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Whose time a replay keeps. Live: the machine's, with ROS time left alone; where /use_sim_time is
/// set it follows /clock. Sim: the recording's, given on /clock. Follow: another node's /clock.
enum class ReplayClock { Live, Sim, Follow };

struct ReplayRequest {
  std::int64_t behavior_id = 0;  ///< 0: the newest called `name`
  std::string name;
  std::string selector;       ///< else, words (replay/query/behavior_selector.hpp)
  std::string only;           ///< "body,ar,speech", any of them; empty: all
  bool allow_motion = false;  ///< without it a replay that would move the body is refused
  double wait_for_subscribers_s = 2.0;
  bool needs_subscribers = false;  ///< a topic that nobody hears by then: refused, else told
  double delay_s = 0;              ///< after that, before the first message
  std::uint32_t queue = 100;
  bool is_realtime = true;  ///< tries SCHED_FIFO
  ReplayClock clock = ReplayClock::Live;
  double clock_hz = 100;  ///< of the /clock that is given
  RateControlOptions rate_control;
  replay::PlanOptions plan;  ///< its `only` is not looked at
  replay::AnchorSettings anchors;
  replay::PlayOptions options;
  replay::MotionLimits limits = replay::MotionLimits::fetch();
  BodyOptions body;
};

/// The behavior asked for. Throws std::runtime_error, one line, if there is none.
replay::Behavior findRequested(const replay::Store& store, const ReplayRequest& request);

/// Any thread may command and look; run() once.
class ReplaySession {
 public:
  /// Finds and plans; needs no master. Throws, with one line: unknown behavior, modality or topic,
  /// nothing to play, motion above the limits, what is not for the body.
  ReplaySession(const replay::Store& store, const ReplayRequest& request);
  ~ReplaySession();

  const replay::PlayPlan& plan() const { return plan_; }
  /// The plan, with how often each field will be rewritten: reads all its messages.
  replay::PlayPlan countedPlan() const;
  /// Throws std::runtime_error, one line, if the replay would move the robot and may not.
  void checkMotionAllowed() const;

  /// Plays and cleans up. Throws std::runtime_error, before anything is advertised, if it would
  /// move the robot and may not, if no master answers within 2 s, or if it should give /clock and
  /// another node does; before anything is sent, for topics that nobody hears, if that is asked
  /// for, and for what BodyGate refuses. Stops, before or while it plays, when another node sends
  /// velocities on a topic that is played.
  replay::PlayReport run();

  void stop(const std::string& reason);
  void pause();
  void resume();
  bool isPaused() const;
  // These throw std::runtime_error, one line, for what is not possible, also before it plays.
  void setRate(double rate);
  void seek(double seconds);
  void playNext(std::uint64_t count);
  bool togglePauseTopics();
  replay::PlayProgress progress() const;

 private:
  replay::PlayReport play(RosSink& sink);
  void openGate(RosSink& sink, replay::Clock& clock);
  void closeGate();
  void addEnd(replay::PlayReport& report) const;
  void waitBeforeStart();
  std::optional<AnchorBroadcast::Moment> moment() const;
  void checkRate(double rate) const;
  RateControl::Replay asSeenByConsumer();
  replay::Player& player() const;
  bool isStopped() const;
  replay::Stamp now() const;

  const replay::Store& store_;
  ReplayRequest request_;
  const replay::PlayPlan plan_;
  const std::vector<replay::MotionPeak> peaks_;
  std::unique_ptr<replay::FollowedClock> followed_;  ///< if another clock is followed
  std::unique_ptr<replay::Clock> own_clock_;         ///< else
  mutable std::mutex mutex_;
  std::unique_ptr<BodyGate> gate_;          ///< while run() plays what moves the robot
  std::unique_ptr<replay::Player> player_;  ///< while run() plays
  std::optional<std::string> stop_reason_;
  bool is_paused_ = false;
};

}  // namespace afterglow::nodes
