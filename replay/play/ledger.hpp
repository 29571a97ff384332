/// \file
/// The book of a replay's measurements, of which the report is made.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "replay/clock/timeline.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/play/figures.hpp"
#include "replay/play/play_report.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Decides nothing and sends nothing. The plan outlives it. One thread, unless it says otherwise.
class Ledger {
 public:
  explicit Ledger(const PlayPlan& plan);

  /// Begins at the replay's first deadline.
  void begin(SteadyTime first_deadline);
  /// Seconds into the behavior.
  double recordedSeconds(Stamp recorded) const;
  /// Seconds since the first deadline.
  double playedSeconds(SteadyTime now) const;

  /// Returns the report of a topic that is played, by its recorded name, to be counted in. Stays
  /// where it is.
  TopicReport& topic(const std::string& name) { return topics_[name]; }
  /// A message went out.
  struct Sent {
    Stamp recorded;  ///< stamp of the recording
    SteadyTime at;
    std::int64_t late_ns = 0;
    double latency_s = 0;  ///< delay of its effect
    double rate = 1;
  };
  void addSent(const PlannedTopic& topic, const Sent& sent);

  /// `end`: the goal's end in the recording, if that is known. A goal that is sent again after a
  /// pause is the same goal.
  void addGoal(const GoalBook::Entry& goal, const std::optional<Milestone>& end);
  void endGoal(const GoalBook::Ended& goal);
  /// All goals without an end were canceled.
  void cancelGoals();

  /// The timeline stood at `at` and waited for `what`, a topic of the body. Waits with less than
  /// half a second between them are one.
  void addWait(Stamp at, SteadyTime since, double seconds, const std::string& what);
  /// Counts a step of the base: the recorded moment it has got to, and how far off its track it is,
  /// in m.
  void addBase(Stamp at, SteadyTime now, std::optional<Stamp> progress,
               std::optional<double> deviation);
  /// The replay pauses, or goes on elsewhere or at another rate: the skew of light and speech is
  /// measured by later milestones only.
  void restartSkew() { skew_.restart(); }

  /// The same messages may come again, after a seek.
  void addDamage(const std::vector<DamagedMessage>& messages);
  void note(const std::string& problem) { report_.notes.push_back(problem); }
  /// Measures the length from the first deadline to now, or to the pause it stands in.
  void measureLength(const Timeline& timeline, SteadyTime now);
  bool hasLength() const { return report_.actual_ns != 0; }

  // ns, for those who watch. Any thread.
  const RecentWorst& recentLateness() const { return recent_lateness_; }
  const RecentWorst& recentSkew() const { return skew_.recent(); }

  /// The base's distances from its track, in m.
  const Samples& deviation() const { return deviation_; }
  /// Returns a report without what other parts of the player know: rate, failures, goal counts, why
  /// it ended.
  PlayReport report() const;

 private:
  void endWait(InStep& in_step) const;

  const PlayPlan& plan_;
  SteadyTime first_deadline_;
  PlayReport report_;
  std::map<std::string, TopicReport> topics_;
  /// Places of goals in the report.
  std::map<std::pair<std::string, std::int64_t>, std::size_t> spans_;
  std::optional<PlayWait> wait_;                                       ///< may go on
  double wait_end_s_ = 0;
  RecentWorst recent_lateness_;
  Skew skew_;
  Samples deviation_;                ///< deviations of the base
  std::set<std::uint64_t> damaged_;  ///< messages that were left out, by sequence
};

}  // namespace afterglow::replay
