/// \file
/// A master that is killed and started again knows no node, and roscpp does not tell it: the node's
/// services could not be called any more, so that a recording could not be ended.
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>

namespace afterglow::nodes {

/// Looks every second whether the master knows this node, in a thread of its own. One that does not
/// is told all that the node publishes, subscribes to and serves. Connections between nodes do
/// not depend on the master and last through its absence. Make it after ros::init; it has to end
/// before ROS shuts down. Source: wiki.ros.org/ROS/Master_API.
class Registration {
 public:
  Registration();
  ~Registration();
  Registration(const Registration&) = delete;
  Registration& operator=(const Registration&) = delete;

 private:
  void run();
  void look();
  bool registerAgain() const;

  std::set<std::string> services_;  ///< services of this node, as a master has told
  bool was_known_ = false;
  std::mutex mutex_;
  bool is_over_ = false;
  std::condition_variable over_;
  std::thread thread_;
};

}  // namespace afterglow::nodes
