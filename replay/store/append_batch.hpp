/// \file
/// Many messages into a store, in appends of a good size, with room for others in between. Internal
/// to replay.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "replay/store/store.hpp"
#include "replay/store/writing_turns.hpp"

namespace afterglow::replay {

class AppendBatch {
 public:
  /// `appended` hears how many were appended so far, after each append. The store must outlive it.
  AppendBatch(Store& store, std::function<void(std::uint64_t)> appended,
              Duplicates duplicates = Duplicates::Refuse)
      : store_(store), appended_(std::move(appended)), duplicates_(duplicates) {}

  void add(Message&& message) {
    bytes_ += message.bytes.size();
    messages_.push_back(std::move(message));
    if (messages_.size() >= kMostMessages || bytes_ >= kMostBytes) flush();
  }

  /// To be called when all are added.
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
