/// \file
/// The way of messages into the store: a queue with a bound, and a thread that empties it in
/// batches.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "replay/record/file_references.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// The reason where memory has ended; no longer than a text that needs none.
constexpr const char* kNoMemory = "out of memory";

/// A message on its way into the store, and what the writer found out about it.
struct QueuedMessage {
  std::int64_t recording = 0;
  const Channel* channel = nullptr;
  Message message;                     ///< message; its bytes are gone when it is written
  std::size_t size = 0;                ///< share of the queue; filled in by the writer
  bool is_unfit = false;               ///< true: its bytes do not fit its type; stored as they are
  std::vector<std::string> files;      ///< files that it refers to (file_references.hpp)
  std::optional<std::string> refusal;  ///< the reason why no store takes it; it was left out
};

/// Work on a store that may be busy: it is done again until the store is free. Any thread.
class StoreRetry {
 public:
  /// Takes `on_busy`, which hears why, once each time that the store is found busy.
  explicit StoreRetry(std::function<void(const std::string& why)> on_busy)
      : on_busy_(std::move(on_busy)) {}

  /// Throws what `work` throws, but StoreBusy only after hurry().
  void insist(const std::function<void()>& work);
  /// Ends waiting for a busy store from now on.
  void hurry();
  bool isBusy() const;  ///< the store, when it was last asked

 private:
  bool wait(const std::string& why);

  const std::function<void(const std::string&)> on_busy_;
  mutable std::mutex mutex_;
  std::condition_variable hurried_;
  bool is_busy_ = false, is_hurried_ = false;
};

/// The channels that were written to, each in each recording: their ids in the store, and how their
/// messages are read. Not thread-safe.
class WrittenChannels {
 public:
  /// Throws StoreError.
  void add(Store& store, std::int64_t recording, const Channel& channel);
  /// Fills in a message's channel, header stamp, files and whether it is unfit. No message is an
  /// error.
  void examine(QueuedMessage& queued) const;

 private:
  struct Known {
    std::int64_t id = 0;
    std::optional<Schema> schema;  ///< empty: the definition cannot be understood
    std::unique_ptr<const FileReferences> references;  ///< null: its type refers to no files
  };
  std::map<std::pair<std::int64_t, const Channel*>, Known> known_;
};

/// Writes queued messages to a store; when appending fails, all that is queued and all that comes
/// is given up, until resume(). One message that no store takes is left out of its batch. Channels
/// must outlive the writer.
class StoreWriter {
 public:
  /// Called by the writer's thread after each batch, in order; `failure`: the batch was given up.
  using OnWritten = std::function<void(const std::deque<QueuedMessage>& batch,
                                       const std::optional<std::string>& failure)>;

  /// `most_bytes` may wait, and no message longer than about `batch_period`.
  StoreWriter(Store& store, StoreRetry& retry, std::size_t most_bytes,
              std::chrono::milliseconds batch_period, OnWritten on_written);
  /// Writes the queue first, unless the store is busy.
  ~StoreWriter();
  StoreWriter(const StoreWriter&) = delete;
  StoreWriter& operator=(const StoreWriter&) = delete;

  /// False: there is no room, or writing has failed. Never waits for the store.
  bool push(QueuedMessage queued);
  /// Returns when all that was pushed before is written or given up, and on_written has heard it.
  void flush();
  std::size_t queuedBytes() const;

  /// Returns why nothing is written any more; empty while all is well, and while the store is busy.
  std::optional<std::string> failure() const;
  void fail(const std::string& why);  ///< unless it has failed already
  void resume();

 private:
  bool isHalfFull() const { return queued_bytes_ > most_bytes_ / 2; }
  void run();
  void writeBatch() noexcept;
  void write(std::deque<QueuedMessage>& batch);

  Store& store_;
  StoreRetry& retry_;
  const std::size_t most_bytes_;
  const std::chrono::milliseconds batch_period_;
  const OnWritten on_written_;
  WrittenChannels channels_;  ///< the thread's

  mutable std::mutex mutex_;
  std::condition_variable to_writer_, from_writer_;
  std::deque<QueuedMessage> queue_;
  std::deque<QueuedMessage> batch_;      ///< the thread's
  std::size_t queued_bytes_ = 0;         ///< bytes in the queue, and in the batch that is written
  std::uint64_t pushed_ = 0, done_ = 0;  ///< messages; done: written or given up
  bool is_flushing_ = false, is_closing_ = false;
  std::optional<std::string> failure_;
  std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace afterglow::replay
