/// \file
/// The way in which a plan is played.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>

#include "replay/plan/modality_options.hpp"

namespace afterglow::replay {

class ArmStart;
class BaseDrive;
class GoalBook;
class MessageAnchor;

struct PlayOptions {
  double rate = 1.0;
  bool clear_projection = true;
  double hold_s = 2.0;  ///< time the light stays after the end before it is cleared
  /// The time that goals may take beyond their recorded end, or the replay's.
  double goal_wait_s = 10.0;
  std::size_t prefetch_bytes = 64u << 20;
  bool is_looping = false;    ///< true only without the body, which ends elsewhere
  bool is_immediate = false;  ///< true: as fast as it goes; for light and speech only
  bool starts_paused = false;
  bool keeps_alive = false;  ///< the end comes with stop() only
  /// The part that is played of a time without messages. At least 0.5 s where the body moves, so
  /// that a base has stopped by itself, and not while goals are under way.
  std::optional<double> skip_empty_s;
  std::set<std::string> pause_topics;  ///< pauses before each message on them
  /// Stamps are left as they were: whoever listens is given recorded time as well.
  bool has_recorded_time = false;
  /// The least time after seek() that the arm has to get to where its trajectory goes on, if it is
  /// elsewhere.
  double seek_lead_s = 5.0;
  MessageAnchor* anchor = nullptr;  ///< anchor of the light, if any; outlives the player
  /// True: what is recorded after a goal's result, or after where the base got to, waits for that.
  bool is_in_step = true;
  ModalityLatency latency_s;  ///< so much earlier messages go out
  FailurePolicy on_failure;
  /// Drives the base instead of the recorded velocities on its topic, which has to be played, and
  /// not in recorded time. Outlives the player.
  BaseDrive* base_drive = nullptr;
  /// Has joint trajectories begin where the joints are, or stops the replay; outlives the player.
  /// None: they are sent as they were recorded.
  ArmStart* arm_start = nullptr;
  /// The frame that looks along its x axis with a head whose controller jumps after a cancel
  /// (presentGaze()); empty: no such head.
  std::string gaze_frame;
  /// The book of open goals, if others look into it; outlives the player. None: a book of its own.
  GoalBook* goals = nullptr;
};

}  // namespace afterglow::replay
