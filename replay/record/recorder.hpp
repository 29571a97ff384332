/// \file
/// The recorder's core: messages come in from any thread, wait in a bounded queue, and are written
/// to the store in batches by one thread of its own. Behaviors that run decide what is kept.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "replay/record/latched_state.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct RecorderOptions {
  /// What may wait for the store, in bytes of messages; what does not fit is dropped and counted.
  std::size_t queue_bytes = 256u << 20;
  /// At most this long does a message wait before its batch is committed.
  std::chrono::milliseconds batch_period{100};
  std::string source = "recorder";  ///< the store's name for this run
  std::string robot;
  /// Topics recorded along with every behavior, e.g. /tf.
  std::vector<std::string> context_topics;
};

/// What became of a behavior's messages so far. Context topics are not counted.
struct RecordedCounts {
  std::uint64_t stored = 0;                ///< committed to the store
  std::uint64_t dropped = 0;               ///< arrived, but could not be kept
  std::vector<std::string> silent_topics;  ///< said nothing, and held no latched message
};

/// Records while behaviors run; several may run at once, overlapping or nested. A message is stored
/// once, however many behaviors cover it; messages of topics that no running behavior covers are
/// not stored. At a behavior's begin the latched messages in force on its topics and the context
/// topics are stored again, stamped with the begin, so that every behavior is whole by itself.
///
/// When the store fails to write, recording stops for good: failure() says why, what was committed
/// stays, everything after counts as dropped. Every method may be called from any thread. The store
/// must outlive the recorder.
class Recorder {
 public:
  /// Throws StoreError if the store cannot be written.
  Recorder(Store& store, RecorderOptions options);
  /// Writes what is queued and stops the thread. Behaviors that still run stay open in the store:
  /// end them first.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// A number for this channel, the same for equal channels; what offer() wants.
  std::size_t channelIndex(const Channel& channel);
  /// Takes a message; `received` is when it arrived, taken by the caller at once. Never waits for
  /// the store.
  void offer(std::size_t channel_index, Stamp received, Bytes bytes);
  /// Forgets latched messages of a topic: nobody listens to it any more.
  void forgetLatched(const std::string& topic);

  /// Starts a behavior whose `begin` is now; id, recording, robot (if empty) and end are filled in
  /// here. A behavior without parent belongs to the deepest running one whose tree path contains
  /// its own. Throws StoreError, also when recording had failed before.
  Behavior begin(Behavior behavior);
  /// Waits until everything offered before is committed, then ends the behavior. Counts are right
  /// even if the recording failed meanwhile (see failure()). Throws std::logic_error for an id that
  /// does not run, StoreError if the end cannot be written.
  RecordedCounts end(std::int64_t behavior_id, Stamp end, const std::string& outcome);

  RecordedCounts counts(std::int64_t behavior_id) const;
  /// Why nothing is recorded any more; empty while all is well.
  std::optional<std::string> failure() const;

 private:
  struct Queued {
    std::size_t channel_index = 0;
    std::size_t size = 0;  ///< what it counts in the queue
    Message message;
  };
  struct Running {
    Behavior behavior;
    std::set<std::string> topics;
    std::set<std::string> heard;
    std::uint64_t stored = 0, dropped = 0;
  };

  bool isContext(const std::string& topic) const { return context_.count(topic) != 0; }
  bool isWanted(const std::string& topic, Stamp received) const;
  void enqueue(std::size_t channel_index, Stamp received, Bytes bytes);
  void enqueueLatched(const Running& running);
  /// What begin() does before and after the store gave the behavior its id.
  std::int64_t admit(Behavior& behavior);
  void rename(std::int64_t from, std::int64_t to);
  std::int64_t enclosing(const std::string& tree_path) const;
  void count(const Queued& queued, std::uint64_t Running::*counter);
  RecordedCounts countsOf(const Running& running) const;
  Running& running(std::int64_t behavior_id);
  void flush(std::unique_lock<std::mutex>& lock);
  void writeLoop();
  void write(std::unique_lock<std::mutex>& lock, std::deque<Queued> batch);
  void appendToStore(std::deque<Queued>& batch,
                     const std::map<std::size_t, const Channel*>& new_channels);

  Store& store_;
  const RecorderOptions options_;
  const std::set<std::string> context_;
  const std::int64_t recording_;  ///< the store's number for this run

  mutable std::mutex mutex_;
  std::condition_variable to_writer_, from_writer_;
  std::deque<Channel> channels_;  ///< by channel index; only grows
  LatchedState latched_;
  std::map<std::int64_t, Running>
      running_;                ///< by the store's id; below 0 until the store knows it
  std::int64_t unstored_ = 0;  ///< how many had an id below 0 so far
  std::deque<Queued> queue_;
  std::size_t queued_bytes_ = 0;
  std::uint64_t next_sequence_ = 0;
  std::uint64_t done_sequence_ = 0;  ///< all below are committed or given up
  bool is_flushing_ = false, is_closing_ = false;
  std::optional<std::string> failure_;

  struct StoreChannel {
    std::int64_t id = 0;
    std::optional<Schema> schema;
  };
  std::map<std::size_t, StoreChannel> store_channels_;  ///< the writer's, by channel index
  std::thread writer_;                                  ///< last: it uses all of the above
};

}  // namespace afterglow::replay
