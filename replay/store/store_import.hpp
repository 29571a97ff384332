/// \file
/// An import into a store: many appends that become visible together, or not at all, with pauses
/// in which others can write. Internal to replay.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Whoever waits for a SQLite store looks every 2 ms whether it is free (sqlite.cpp): a pause of
/// 10 ms lets them in, also on a busy machine.
class WritingTurns {
 public:
  /// Gives way between two transactions.
  void next() {
    const auto now = std::chrono::steady_clock::now();
    if (now - begin_ < kTurn) return;
    std::this_thread::sleep_for(kPause);
    begin_ = std::chrono::steady_clock::now();
  }

 private:
  static constexpr std::chrono::milliseconds kTurn{100}, kPause{10};
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Drops the recording if it is destroyed before finish() has returned. The recording of a program
/// that dies is dropped by the next import.
class StoreImport {
 public:
  StoreImport(Store& store, const std::string& source) : store_(store) {
    store.dropUnfinished();
    recording_ = store.beginImport({0, "", source, ""});
  }
  StoreImport(const StoreImport&) = delete;
  StoreImport& operator=(const StoreImport&) = delete;
  ~StoreImport() {
    if (is_finished_) return;
    try {
      store_.dropRecording(recording_);
    } catch (const std::exception&) {
      // The store is what failed, or memory: dropUnfinished() will do it.
    }
  }

  std::int64_t recording() const { return recording_; }
  /// `work` adds the behaviors.
  template <typename Work>
  void finish(const Work& work) {
    store_.transaction([&] {
      work();
      store_.finishImport(recording_);
    });
    is_finished_ = true;
  }

 private:
  Store& store_;
  std::int64_t recording_ = 0;
  bool is_finished_ = false;
};

/// Many messages into a store, in appends of a good size, with pauses in which others can write.
class AppendBatch {
 public:
  /// `appended` is called after each append, with the number of messages appended so far. The store
  /// must outlive it.
  AppendBatch(Store& store, std::function<void(std::uint64_t)> appended,
              Duplicates duplicates = Duplicates::Refuse)
      : store_(store), appended_(std::move(appended)), duplicates_(duplicates) {}

  void add(Message&& message) {
    bytes_ += message.bytes.size();
    messages_.push_back(std::move(message));
    if (messages_.size() >= kMostMessages || bytes_ >= kMostBytes) flush();
  }

  /// Flushes when all are added.
  void flush() {
    store_.append(messages_, duplicates_);
    turns_.next();
    done_ += messages_.size();
    messages_.clear();
    bytes_ = 0;
    if (appended_) appended_(done_);
  }

  std::uint64_t done() const { return done_; }

 private:
  /// An append ends with the message that reaches one of these: about a tenth of a second's work,
  /// behind which others wait.
  static constexpr std::size_t kMostMessages = 5000;
  static constexpr std::size_t kMostBytes = 8 << 20;

  Store& store_;
  WritingTurns turns_;
  std::function<void(std::uint64_t)> appended_;
  const Duplicates duplicates_;
  std::vector<Message> messages_;
  std::size_t bytes_ = 0;
  std::uint64_t done_ = 0;
};

}  // namespace afterglow::replay
