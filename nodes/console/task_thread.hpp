/// \file
/// A thread for what takes its time, so that the server's threads do not.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace afterglow::nodes {

/// Does what is posted, one after the other.
class TaskThread {
 public:
  static constexpr std::size_t kMostWaiting = 16;

  TaskThread();
  /// Waits for the task under way; the others are dropped.
  ~TaskThread();
  TaskThread(const TaskThread&) = delete;
  TaskThread& operator=(const TaskThread&) = delete;

  /// False: too many wait. A task does not throw. Any thread.
  bool post(std::function<void()> task);

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool is_ending_ = false;
  std::thread thread_;
};

}  // namespace afterglow::nodes
