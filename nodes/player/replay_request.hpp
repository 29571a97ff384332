/// \file
/// The request for a replay, and what will be played for it: needs no ROS master.
#pragma once

#include <cstdint>
#include <string>

#include "nodes/player/body_gate.hpp"
#include "nodes/player/ros_clock.hpp"
#include "nodes/player/ros_sink.hpp"
#include "replay/plan/anchoring.hpp"
#include "replay/play/player.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// A replay's options, with what holds if they are not given; play_options.hpp is how they are
/// given.
struct ReplayRequest {
  std::string behavior;       ///< id of the behavior, or words (replay/query/behavior_selector.hpp)
  std::string only;           ///< "body,ar,speech", any of them; empty: all
  bool allow_motion = false;  ///< false: a replay that would move the body is refused
  bool everything = false;  ///< all but motion and control inputs, where no robot is live
  bool is_prefix_live = false;  ///< a robot is, under the prefix of `plan`
  double wait_for_subscribers_s = 2.0;
  bool needs_subscribers = false;  ///< a topic that nobody hears by then: refused, else told
  double delay_s = 0;              ///< delay after that, before the first message
  std::uint32_t queue = 100;
  bool is_realtime = true;  ///< tries SCHED_FIFO
  ReplayClock clock = ReplayClock::Live;
  double clock_hz = 100;  ///< rate of the /clock that is given
  RateControlOptions rate_control;
  /// The plan's options, whose `only`, `obeyed`, `is_motion_allowed`, `place`, `resolve` and
  /// `robot` are not looked at.
  replay::PlanOptions plan;
  replay::AnchorSettings anchors;
  replay::PlayOptions options;
  /// Today's robot's; empty: ROS's own of this process, else the recording's.
  std::string robot_namespace;
  BodyOptions body;

  /// A prefix leads away from the robot, unless it is another one's that may move, or is live.
  replay::ReplayPlace place() const;
};

/// The request with what the profile says under the names of today's robot, and the recorded
/// robot's names brought to these. Throws StoreError, and as selectBehavior() does.
ReplayRequest forItsRobot(const replay::Store& store, ReplayRequest request);

/// Throws, with one line: unknown behavior, modality or topic, what is not for the body, light that
/// has no place if there is nothing else.
replay::PlayPlan planReplay(const replay::Store& store, const ReplayRequest& request);

/// Returns why a topic is played or not, with the reason for its class where that is another one.
std::string reasonOf(const replay::PlannedTopic& topic);

/// Throws std::runtime_error, one line, if the plan publishes nothing.
void checkSomethingToPlay(const replay::PlayPlan& plan, const ReplayRequest& request);

/// The plan, with how often each field will be rewritten: reads all its messages.
replay::PlayPlan countRewrites(const replay::Store& store, replay::PlayPlan plan,
                               ReplayClock clock);

}  // namespace afterglow::nodes
