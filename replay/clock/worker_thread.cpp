#include "replay/clock/worker_thread.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {

TaskThread::TaskThread(std::size_t most_waiting)
    : most_waiting_(most_waiting), thread_([this] { run(); }) {}

TaskThread::~TaskThread() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

bool TaskThread::post(std::function<void()> task, std::size_t most_waiting) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (tasks_.size() >= std::min(most_waiting, most_waiting_)) return false;
    tasks_.push_back(std::move(task));
  }
  changed_.notify_all();
  return true;
}

void TaskThread::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_ending_ || !tasks_.empty(); });
    if (is_ending_) return;
    auto task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    task = nullptr;  // what it holds may take its time to go
    lock.lock();
  }
}

RepeatingThread::RepeatingThread(std::chrono::nanoseconds period, std::function<void()> work)
    : period_(period), work_(std::move(work)) {}

void RepeatingThread::begin() {
  thread_ = std::thread([this] { run(); });
}

void RepeatingThread::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_stopped_ = true;
  }
  stopped_.notify_all();
  if (thread_.joinable()) thread_.join();
}

bool RepeatingThread::sleepUntil(Time when) const {
  std::unique_lock<std::mutex> lock(mutex_);
  return !stopped_.wait_until(lock, when, [this] { return is_stopped_; });
}

void RepeatingThread::run() {
  Time next;
  do {
    next = std::chrono::steady_clock::now() + period_;
    work_();
  } while (sleepUntil(next));
}

}  // namespace afterglow::replay
