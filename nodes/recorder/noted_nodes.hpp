/// \file
/// Which nodes stand around topics now, for a behavior's snapshot.
#pragma once

#include <string>
#include <vector>

#include "replay/record/snapshot.hpp"

namespace afterglow::nodes {

/// Who publishes and who hears these topics, the answers of those that are goals, and all
/// velocities and joysticks, without this node; asked of the master. Empty if it does not answer.
replay::RecordedNodes nodesNow(const std::vector<std::string>& topics);

}  // namespace afterglow::nodes
