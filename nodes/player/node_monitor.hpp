/// \file
/// The watch over the ROS master and over the nodes that publish a topic, while the robot moves.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// Connections outlive the master, but whoever would stop the robot by a new one does not get
/// through: without it nothing moves. Asks four times a second; one answer may be lost.
class MasterMonitor {
 public:
  /// Takes `on_lost`, which is called once, in a thread of its own: 0.75 s after a master's end at
  /// most, 2.5 s after it has begun to hang.
  explicit MasterMonitor(std::function<void(const std::string& reason)> on_lost);

 private:
  void look();

  const std::function<void(const std::string&)> on_lost_;
  MasterLink master_;
  int missed_ = 0;  ///< number of misses in a row
  CallbackThread thread_;
};

/// Watches whether nodes still live. A connection does not tell: roscpp keeps that to a node that
/// was killed, and a node that hangs keeps its own. Asks them again and again, in a thread of its
/// own: one that was killed or hangs is noticed within 1.5 s.
class PublisherMonitor {
 public:
  /// Takes `on_gone`: a node has not answered twice; said once.
  explicit PublisherMonitor(std::function<void(const std::string& node)> on_gone);

  /// Makes this node one that has to answer from now on. Any thread; a node that is known already
  /// is left alone.
  void add(const std::string& node);

 private:
  struct Known {
    std::optional<NodeAddress> address;  ///< asked of the master once, which may die
    int unanswered = 0;
  };

  void look();
  bool isGone(const std::string& node);

  const std::function<void(const std::string&)> on_gone_;
  std::mutex mutex_;
  std::set<std::string> nodes_;
  std::map<std::string, Known> known_;  ///< look()'s
  bool has_told_ = false;               ///< likewise
  CallbackThread thread_;
};

}  // namespace afterglow::nodes
