/// \file
/// The nodes that stand around topics now, for a behavior's snapshot.
#pragma once

#include <string>
#include <vector>

#include "replay/record/snapshot.hpp"

namespace afterglow::nodes {

/// Asks the master who publishes and who hears these topics, the answers of those that are goals,
/// and all velocities and joysticks, without this node. Empty if it does not answer.
replay::RecordedNodes nodesNow(const std::vector<std::string>& topics);

}  // namespace afterglow::nodes
