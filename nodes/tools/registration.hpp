/// \file
/// A master that is killed and started again knows no node, and roscpp does not tell it: the node's
/// services could not be called any more, so that a recording could not be ended.
#pragma once

#include <set>
#include <string>

#include "replay/clock/worker_thread.hpp"

namespace afterglow::nodes {

/// Looks every second whether the master knows this node, in a thread of its own. One that does not
/// is told all that the node publishes, subscribes to and serves. Connections between nodes do
/// not depend on the master and last through its absence. Make it after ros::init; it has to end
/// before ROS shuts down. Source: wiki.ros.org/ROS/Master_API.
class Registration {
 public:
  Registration();

 private:
  void look();
  bool registerAgain() const;

  std::set<std::string> services_;  ///< services of this node, as a master has told
  bool was_known_ = false;
  replay::RepeatingThread thread_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
