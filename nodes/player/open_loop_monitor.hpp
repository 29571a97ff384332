/// \file
/// Looks where recorded velocities would lead a base that is driven in open loop. It cannot wait,
/// for the others go on by the clock: what stands in its way ends the replay.
#pragma once

#include <functional>
#include <set>
#include <string>

#include "replay/motion/base/base_tracker.hpp"
#include "replay/motion/base/obstacle_stop.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/play/outbox.hpp"

namespace afterglow::nodes {

/// Stands between a player and the sink it publishes on. Everything given must outlive it; one
/// thread.
class OpenLoopMonitor : public replay::MessageSink {
 public:
  /// `look`: the newest odometry, if it is known, and scan. `stop`: ends the replay.
  OpenLoopMonitor(const replay::PlayPlan& plan, replay::MessageSink& sink,
                  const replay::ObstacleOptions& options, std::function<replay::BaseInput()> look,
                  std::function<void(const std::string& reason)> stop);

  /// A velocity whose way is not free becomes a zero and ends the replay.
  bool publish(const replay::Channel& channel, const replay::Bytes& bytes) override;

 private:
  std::string whyNot(const replay::Bytes& velocity);

  replay::MessageSink& sink_;
  replay::ObstacleStop obstacles_;
  const std::function<replay::BaseInput()> look_;
  const std::function<void(const std::string&)> stop_;
  std::set<std::string> topics_;  ///< topics of velocities
};

}  // namespace afterglow::nodes
