/// \file
/// Whether the map is the one that a behavior was recorded on.
#pragma once

#include <functional>
#include <string>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Why what was recorded in the map's frame is elsewhere now, a clause; empty: it is not, or it is
/// not known which map it was. Waits for a map that somebody publishes at most 5 s, or until
/// `is_stopped`. Throws as askMaster().
std::string whyOtherMap(const replay::Behavior& behavior, const std::string& topic,
                        const std::function<bool()>& is_stopped);

}  // namespace afterglow::nodes
