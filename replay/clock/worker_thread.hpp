/// \file
/// Threads of a class's own: for tasks in their order, and for work that comes again and again. As
/// the last member of its class such a thread ends before the members that it uses.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <limits>
#include <mutex>
#include <thread>

namespace afterglow::replay {

/// Does the tasks that are posted, one after the other.
class TaskThread {
 public:
  /// So many tasks may wait.
  explicit TaskThread(std::size_t most_waiting = 16);
  /// Waits for the task under way; the others are dropped.
  ~TaskThread();
  TaskThread(const TaskThread&) = delete;
  TaskThread& operator=(const TaskThread&) = delete;

  /// Returns false if too many wait, or `most_waiting`. A task does not throw. Any thread.
  bool post(std::function<void()> task,
            std::size_t most_waiting = std::numeric_limits<std::size_t>::max());

 private:
  void run();

  const std::size_t most_waiting_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool is_ending_ = false;
  std::thread thread_;  ///< last: it uses all of the above
};

/// Once begun, does its work at once, then again after each period, until it is stopped.
class RepeatingThread {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `period`: from one beginning to the next; longer work is followed by the next at once. The
  /// work does not throw.
  RepeatingThread(std::chrono::nanoseconds period, std::function<void()> work);
  ~RepeatingThread() { stop(); }
  RepeatingThread(const RepeatingThread&) = delete;
  RepeatingThread& operator=(const RepeatingThread&) = delete;

  void begin();
  /// Waits for the work under way, which is the last. Any number of times.
  void stop();
  /// Sleeps for the work itself: returns false as soon as the thread is stopped.
  bool sleepUntil(Time when) const;

 private:
  void run();

  const std::chrono::nanoseconds period_;
  const std::function<void()> work_;
  mutable std::mutex mutex_;
  mutable std::condition_variable stopped_;
  bool is_stopped_ = false;
  std::thread thread_;
};

}  // namespace afterglow::replay
