/// \file
/// The measured report of a replay.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/base/base_drive.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/play/figures.hpp"

namespace afterglow::replay {

struct TopicReport {
  std::uint64_t published = 0;
  std::uint64_t skipped = 0;  ///< too late, and overtaken or dangerous
  std::uint64_t refused = 0;  ///< not publishable: the text says why
  /// Recorded velocities that were not sent: the base was driven along its track instead.
  std::uint64_t replaced = 0;
  std::string problem;     ///< problem of the last refused one
  bool was_heard = false;  ///< somebody listened when the last message went out
  Lateness lateness;
  Samples moments;  ///< moments of publishing; values: ms late
};

/// The timeline stood until the body had got there. Times as in Sample.
struct PlayWait {
  double recorded_s = 0, played_s = 0;  ///< place and time of its begin
  double seconds = 0;
  std::string what;  ///< the topic that was waited for
};

struct InStep {
  bool is_gated = true;         ///< nothing ran ahead of the body
  std::vector<PlayWait> waits;  ///< the first kMostWaits
  std::uint64_t wait_count = 0;
  double waited_s = 0;
  std::map<Modality, ModalitySkew> skew;

  static constexpr std::size_t kMostWaits = 500;
  void add(const PlayWait& wait);
};

/// A goal in the recording and in the replay. Times as in Sample; without an end: not known.
struct GoalSpan {
  std::string topic;
  double recorded_begin_s = 0, played_begin_s = 0;
  std::optional<double> recorded_end_s, played_end_s;
  GoalOutcome outcome = GoalOutcome::Open;
};

/// The failures of a modality.
struct ModalityFailures {
  std::uint64_t count = 0;
  std::string first;  ///< a sentence
};

/// The drives of the base of a velocity topic.
struct PlayedBase {
  std::string topic;
  std::string why_open_loop;              ///< reason for velocities as recorded: a clause
  std::optional<BaseDriveReport> driven;  ///< else
  Samples deviation;                      ///< m off the recorded track
};

/// The stance of the robot at the end, against how it stood when it was recorded. Not measured for
/// a replay that was stopped.
struct BodyEnd {
  std::map<std::string, double> joints;  ///< live less recorded, rad, or m of those that slide
  std::set<std::string> sliding;
  struct Base {
    double distance = 0, turn = 0;  ///< m, rad (>= 0), as localization sees them
    PoseError doubt = {};           ///< uncertainty (BaseReport::end_doubt); 0: not known
    double gone_since_localized = 0;  ///< m, if the doubt is known
  };
  std::optional<Base> base;
  std::vector<std::string> remarks;  ///< unknown facts, a sentence each
};

/// The guards that would have stopped the robot if the player, its machine or the network had gone.
struct PlayGuards {
  double patience_ms = 0;  ///< patience of the watchdog beside the player
  double lateness_ms = 0;  ///< lateness of this machine before motion
  double waiting = 0;      ///< the part of the last minute in which programs waited for it
  struct OnRobot {
    std::string node;
    double patience_ms = 0;
    double longest_gap_ms = 0;  ///< gap between two heartbeats, before motion
    bool is_afar = false;       ///< true: over a network
  };
  std::optional<OnRobot> on_robot;  ///< if a guard runs there
};
/// Sentences, without periods.
std::vector<std::string> toText(const PlayGuards& guards);

struct PlayReport {
  std::int64_t behavior_id = 0;
  std::string behavior_name;
  double begin_s = 0;  ///< place in the behavior where it began
  double rate = 1;     ///< rate at the begin
  bool is_complete = false;
  std::string reason;  ///< the reason why it ended early; empty if it did not
  std::vector<std::string> notes;
  std::string scheduling;       ///< scheduling of the thread that played, if the caller says so
  std::int64_t planned_ns = 0;  ///< the behavior's length, at the rate
  std::int64_t actual_ns = 0;   ///< time from the first deadline to the end, without pauses
  std::vector<std::pair<PlannedTopic, TopicReport>> topics;
  GoalBook::Counts goals;
  std::vector<GoalSpan> goal_spans;  ///< the first kMostGoals
  InStep in_step;
  std::map<Modality, ModalityFailures> failures;
  std::optional<PlayedBase> base;  ///< if a velocity topic was played
  std::optional<BodyEnd> body_end;
  std::optional<PlayGuards> guards;  ///< guards from the moment on at which they were ready

  static constexpr std::size_t kMostGoals = 500;
  /// Adds to the notes, but for empty texts.
  void note(const std::vector<std::string>& texts);
};

/// The reason for skipping a message: a clause.
constexpr const char* kWhySkipped = "too late, and overtaken or dangerous";

/// Notes on topics that had no subscriber at the start: nobody heard what was sent, and what was
/// not sent is said so.
std::vector<std::string> unheardNotes(const std::vector<std::string>& unheard,
                                      const PlayReport& report);

std::optional<std::pair<std::string, double>> worstJoint(const BodyEnd& end);
/// Returns how far from its recorded end the base ended: as the last drive found while it stood,
/// else as tf had it. Empty if neither is known.
std::optional<BodyEnd::Base> baseEnd(const PlayReport& report);

/// The largest figures over all drives, in m and rad, and all corrections.
struct DriveSummary {
  double largest_distance = 0;
  double drift_distance = 0, drift_turn = 0;
  int corrections = 0;
};
DriveSummary summaryOf(const BaseDriveReport& driven);

/// Stable keys:
/// - behavior_id, name, completed, reason (why it ended early), notes, scheduling, begin_s, rate,
///   planned_s, actual_s (without pauses), goals {sent, succeeded, failed, canceled};
/// - in_step {gated, waits, waited_s, skew_ms {ar, speech: {messages, p50, p95, max}}};
/// - body {joints {name: live less recorded at the end, rad or m}, worst {joint, error}, not_known,
///   base {distance_m, turn_deg, uncertainty_m, uncertainty_deg, localized_m_ago, topic,
///   closed_loop, why_open_loop; in closed loop: localized,
///   length_m, drives, largest_deviation_m, drift_m, drift_deg, corrections, delay_s,
///   waited_for_poses_s, waited_for_obstacles_s (if it did), lost}}; without worst, not_known,
///   base, distance_m, turn_deg, uncertainty_m, uncertainty_deg, localized_m_ago where nothing is
///   known;
/// - guards {patience_ms, lateness_ms, waiting (for a processor, 0 to 1), on_robot {node,
/// patience_ms,
///   longest_gap_ms, over_network}}, on_robot only where a guard runs there, guards only where the
///   body was to move;
/// - failures {body, ar, speech: {count, first}}, dropped and refused [{topic, count, why}];
/// - topics {name: {type, count, class (name(TopicClass)), why (it has that class), stop (how its
///   motion is stopped; only of what moves), modality, published_as, rewritten [{field, rule,
/// count}], published, skipped, refused, problem, replaced (if any were), heard, lateness_ms {p50,
///   p99, max}, drift_ms}, or {type, count, class, why, stop, not_played}}.
nlohmann::ordered_json toJson(const PlayReport& report);
/// The plan alone, as `afterglow play --dry-run` shows it.
nlohmann::ordered_json toJson(const PlayPlan& plan);

}  // namespace afterglow::replay
