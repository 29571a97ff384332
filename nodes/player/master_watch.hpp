/// \file
/// Whether the ROS master is still there while the robot moves.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace afterglow::nodes {

/// Connections outlive the master, but whoever would stop the robot by a new one does not get
/// through: without it nothing moves. Asks four times a second; one answer may be lost.
class MasterWatch {
 public:
  /// `on_lost` is called once, in a thread of its own: 0.75 s after a master's end at most, 2.5 s
  /// after it has begun to hang.
  explicit MasterWatch(std::function<void(const std::string& reason)> on_lost);
  ~MasterWatch();
  MasterWatch(const MasterWatch&) = delete;
  MasterWatch& operator=(const MasterWatch&) = delete;

 private:
  void run();

  const std::function<void(const std::string&)> on_lost_;
  std::mutex mutex_;
  bool is_over_ = false;
  std::condition_variable over_;
  std::thread thread_;
};

}  // namespace afterglow::nodes
