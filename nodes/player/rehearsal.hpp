/// \file
/// The refusals of a live replay, found without moving, advertising or publishing: what `afterglow
/// play --dry-run` tells.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "nodes/player/body_gate.hpp"

namespace afterglow::nodes {

struct Rehearsal {
  std::vector<std::string> refusals;   ///< refusals, a line each, as the replay would say it
  std::vector<std::string> unchecked;  ///< nouns for what can only be known later, or with a master
  std::vector<std::string> slowed;     ///< drives that take longer than the rate says: sentences

  /// Empty: nothing is refused.
  void add(const std::string& refusal) {
    if (!refusal.empty()) refusals.push_back(refusal);
  }
  /// Runs a check; what it throws is a refusal.
  void ask(const std::function<void()>& check);
};

/// Finds what BodyGate::check() would refuse. With a master ROS has been started: it asks the
/// graph, and listens to emergency stop, poses, scan and joints, a few seconds each. Without one it
/// goes by the recording and the options. Throws StoreError.
void rehearseBody(const replay::Store& store, const replay::PlayPlan& plan,
                  const BodyOptions& options, bool has_master,
                  const std::function<bool()>& is_stopped, Rehearsal& rehearsal);

}  // namespace afterglow::nodes
