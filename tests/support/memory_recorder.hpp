/// \file
/// A recorder that records nothing but what it was asked, and that can be slow.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "afterglow/recorder_client.hpp"

namespace afterglow::test {

class MemoryRecorder : public nodes::RecorderClient {
 public:
  std::int64_t start(const nodes::RecordingOptions& options) override {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return is_open_; });
    if (!refusal_.empty()) throw std::runtime_error(refusal_);
    if (is_absent_) throw nodes::RecorderAbsent("nobody there");
    started_.push_back(options);
    note("start " + options.tree_path + " #" + std::to_string(options.attempt));
    return static_cast<std::int64_t>(started_.size());
  }
  void stop(std::int64_t id, const std::string& outcome) override {
    std::unique_lock<std::mutex> lock(mutex_);
    const std::string tree_path = started_.at(static_cast<std::size_t>(id - 1)).tree_path;
    changed_.wait(lock, [&] { return is_open_ && tree_path != held_; });
    note("stop " + tree_path + " " + outcome);
  }

  /// Closed, it answers nothing.
  void setOpen(bool is_open) {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_open_ = is_open;
    changed_.notify_all();
  }
  /// Of this one the end is not answered; empty: none.
  void hold(const std::string& tree_path) {
    const std::lock_guard<std::mutex> lock(mutex_);
    held_ = tree_path;
    changed_.notify_all();
  }
  void refuse(const std::string& reason) { refusal_ = reason; }
  void leave() { is_absent_ = true; }

  /// Waits until so many calls were answered, then returns them all.
  std::vector<std::string> calls(std::size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(20), [&] { return calls_.size() >= count; });
    return calls_;
  }
  std::vector<std::string> calls() { return calls(0); }
  nodes::RecordingOptions asked(std::size_t index) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return started_.at(index);
  }

 private:
  void note(const std::string& call) {
    calls_.push_back(call);
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = true, is_absent_ = false;
  std::string refusal_, held_;
  std::vector<nodes::RecordingOptions> started_;
  std::vector<std::string> calls_;
};

using Calls = std::vector<std::string>;

}  // namespace afterglow::test
