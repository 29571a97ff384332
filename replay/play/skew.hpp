/// \file
/// The distance of light and speech from the body in time, measured where they are published.
#pragma once

#include <deque>
#include <map>
#include <vector>

#include "replay/clock/clock.hpp"
#include "replay/play/play_report.hpp"
#include "replay/play/recent_worst.hpp"

namespace afterglow::replay {

/// A message's skew is how far its moment is from where it was recorded relative to the body's last
/// milestone: the last that had been recorded by then, give or take kMilestoneMarginNs, whether it
/// was reached in time or not. Above zero: the message came later than the body. What was recorded
/// before the first milestone is not measured. One thread, but for recent().
class Skew {
 public:
  /// Takes the behavior's begin and the replay's first deadline, for the samples.
  void begin(Stamp begin, SteadyTime start);

  /// The body is on its way to a milestone; reach() is to follow.
  void expect(Stamp milestone);
  void reach(Stamp milestone, SteadyTime at);
  /// A message takes effect; its rate is in recorded seconds a second.
  void add(Modality modality, Stamp recorded, SteadyTime at, double rate);
  /// Forgets all milestones: the replay paused, or goes on elsewhere or at another rate.
  void restart();

  const std::map<Modality, ModalitySkew>& measured() const { return measured_; }
  /// ns, either way.
  const RecentWorst& recent() const { return recent_; }

 private:
  struct Reached {
    Stamp milestone;
    SteadyTime at;
  };
  struct Sent {
    Modality modality;
    Stamp recorded;
    SteadyTime at;
    double rate;
  };
  /// True if the message was measured or has no milestone to be measured by; false: later.
  bool measure(const Sent& sent);

  Stamp begin_;
  SteadyTime start_;
  std::vector<Stamp> expected_;
  std::deque<Reached> reached_;  ///< the last ones
  std::deque<Sent> early_;       ///< sent before the milestone they are measured by
  std::map<Modality, ModalitySkew> measured_;
  RecentWorst recent_;
};

}  // namespace afterglow::replay
