/// \file
/// Whether the ROS master is still there while the robot moves.
#pragma once

#include <functional>
#include <string>

#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// Connections outlive the master, but whoever would stop the robot by a new one does not get
/// through: without it nothing moves. Asks four times a second; one answer may be lost.
class MasterWatch {
 public:
  /// `on_lost` is called once, in a thread of its own: 0.75 s after a master's end at most, 2.5 s
  /// after it has begun to hang.
  explicit MasterWatch(std::function<void(const std::string& reason)> on_lost);

 private:
  void look();

  const std::function<void(const std::string&)> on_lost_;
  MasterLink master_;
  int missed_ = 0;  ///< in a row
  CallbackThread thread_;
};

}  // namespace afterglow::nodes
