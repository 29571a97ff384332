/// \file
/// A store in memory that can be told to fail or to be slow.
#pragma once

#include <atomic>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"

namespace afterglow::test {

class FaultyStore : public replay::Store {
 public:
  /// Every write from now on throws StoreError with this text.
  void failWith(const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex_);
    failure_ = text;
  }
  /// Every write throws StoreBusy while this is so.
  void keepBusy(bool is_busy) {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_busy_ = is_busy;
  }
  /// Messages of more bytes are refused from now on.
  void refuseLargerThan(std::size_t bytes) { largest_ = bytes; }
  /// Cursors made from now on throw after so many messages.
  void breakReadingAfter(std::size_t messages) { readable_ = messages; }
  /// The message of this sequence has changed on the disk: cursors leave it out, and say so.
  void damage(std::uint64_t sequence) { damaged_ = sequence; }
  /// append() waits while this is true.
  std::atomic<bool> is_stalled{false};

  std::int64_t addRecording(const replay::Recording& recording) override {
    return checked().addRecording(recording);
  }
  std::int64_t beginImport(const replay::Recording& recording) override {
    return checked().beginImport(recording);
  }
  void finishImport(std::int64_t recording) override { checked().finishImport(recording); }
  void dropRecording(std::int64_t recording) override { checked().dropRecording(recording); }
  std::size_t dropUnfinished() override { return checked().dropUnfinished(); }
  std::int64_t addChannel(std::int64_t recording, const replay::Channel& channel) override {
    return checked().addChannel(recording, channel);
  }
  void append(const std::vector<replay::Message>& messages,
              replay::Duplicates duplicates = replay::Duplicates::Refuse) override {
    while (is_stalled) std::this_thread::yield();
    for (std::size_t i = 0; i < messages.size(); ++i) {
      if (messages[i].bytes.size() > largest_) throw replay::MessageRefused("too large", i);
    }
    checked().append(messages, duplicates);
  }
  std::int64_t addBehavior(const replay::Behavior& behavior) override {
    return checked().addBehavior(behavior);
  }
  void updateBehavior(const replay::Behavior& behavior) override {
    checked().updateBehavior(behavior);
  }
  void removeBehavior(std::int64_t id) override { checked().removeBehavior(id); }
  void addFile(const std::string& sha256, const replay::Bytes& contents) override {
    checked().addFile(sha256, contents);
  }
  void transaction(const std::function<void()>& work) override { checked().transaction(work); }

  std::vector<replay::Recording> recordings() const override { return store_->recordings(); }
  std::vector<std::string> explain(const replay::BehaviorFilter& filter) const override {
    return store_->explain(filter);
  }
  std::optional<replay::Behavior> behaviorOfKey(const std::string& key) const override {
    return store_->behaviorOfKey(key);
  }
  std::optional<replay::Bytes> file(const std::string& sha256) const override {
    return store_->file(sha256);
  }
  std::vector<replay::Behavior> behaviors(const replay::BehaviorFilter& filter) const override {
    return store_->behaviors(filter);
  }
  std::optional<replay::Behavior> behavior(std::int64_t id) const override {
    return store_->behavior(id);
  }
  std::vector<replay::TopicSummary> topics(const replay::Behavior& behavior) const override {
    return store_->topics(behavior);
  }
  std::vector<replay::TopicSummary> contextTopics(const replay::Behavior& behavior) const override {
    return store_->contextTopics(behavior);
  }
  replay::Channel channel(std::int64_t id) const override { return store_->channel(id); }
  std::unique_ptr<replay::MessageCursor> messages(
      const replay::Behavior& behavior, const replay::MessageRange& range) const override {
    auto cursor = store_->messages(behavior, range);
    if (damaged_) cursor = std::make_unique<DamagedCursor>(std::move(cursor), *damaged_);
    if (!readable_) return cursor;
    return std::make_unique<BreakingCursor>(std::move(cursor), *readable_);
  }

 private:
  class BreakingCursor : public replay::MessageCursor {
   public:
    BreakingCursor(std::unique_ptr<replay::MessageCursor> cursor, std::size_t readable)
        : cursor_(std::move(cursor)), left_(readable) {}
    std::optional<replay::Message> next() override {
      if (left_-- == 0) throw replay::StoreError("disk read error");
      return cursor_->next();
    }

   private:
    std::unique_ptr<replay::MessageCursor> cursor_;
    std::size_t left_;
  };

  class DamagedCursor : public replay::MessageCursor {
   public:
    DamagedCursor(std::unique_ptr<replay::MessageCursor> cursor, std::uint64_t sequence)
        : cursor_(std::move(cursor)), sequence_(sequence) {}
    std::optional<replay::Message> next() override {
      auto message = cursor_->next();
      if (!message || message->sequence != sequence_) return message;
      damaged_.push_back({message->channel, message->received, sequence_, "checksum"});
      return cursor_->next();
    }
    std::vector<replay::DamagedMessage> damaged() const override { return damaged_; }

   private:
    std::unique_ptr<replay::MessageCursor> cursor_;
    const std::uint64_t sequence_;
    std::vector<replay::DamagedMessage> damaged_;
  };

  replay::Store& checked() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!failure_.empty()) throw replay::StoreError(failure_);
    if (is_busy_) throw replay::StoreBusy("another process writes");
    return *store_;
  }

  std::mutex mutex_;
  std::string failure_;
  bool is_busy_ = false;
  std::atomic<std::size_t> largest_{std::numeric_limits<std::size_t>::max()};
  std::optional<std::size_t> readable_;
  std::optional<std::uint64_t> damaged_;
  std::unique_ptr<replay::Store> store_ = replay::openMemoryStore();
};

}  // namespace afterglow::test
