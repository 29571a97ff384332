/// \file
/// The recorder's core: messages come in from any thread, wait in a bounded queue, and are written
/// to the store in batches by one thread of its own. Behaviors that run decide what is kept.
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
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "replay/record/clock_watch.hpp"
#include "replay/record/file_references.hpp"
#include "replay/record/pre_roll.hpp"
#include "replay/record/running_behavior.hpp"
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
  /// How far a behavior can reach back, and the bytes of messages that are remembered for it.
  std::chrono::nanoseconds pre_roll{0};
  std::size_t pre_roll_bytes = 64u << 20;
};

/// How one behavior is recorded.
struct RecordingTerms {
  std::vector<TopicLimit> limits;  ///< latched messages in force at the begin are kept anyway
  std::int64_t pre_roll_ns = 0;    ///< begins so much earlier, as far as is remembered
};

/// Since the recorder was made.
struct RecorderLoad {
  std::uint64_t messages = 0, bytes = 0;  ///< committed
  std::uint64_t dropped = 0;              ///< wanted, but could not be kept
  std::size_t queued_bytes = 0;           ///< waiting now
};

/// Records while behaviors run; several may run at once, overlapping or nested. A message is stored
/// once, however many behaviors cover it (if any of them wants it after its limits); messages that
/// no running behavior covers are not stored. At a behavior's begin the latched messages in force
/// on its topics and the context topics are stored again, stamped with the begin, so that every
/// behavior is whole by itself.
///
/// Within one recording of the store stamps never go back, so that their order is that of arrival.
/// If ROS time does (by more than half a second; less is evened out), stamps go on from the last
/// one while behaviors run, the clock's differences kept, and these behaviors' remarks say by how
/// much they are ahead of the clock. When none runs any more a new recording is begun, with true
/// stamps.
///
/// While somebody else keeps the store busy, what arrives waits in the queue, and begin() refuses;
/// the ends of behaviors wait, too. A message that is no message of its type is kept, one that no
/// store takes is left out; either is counted in the behaviors' remarks. When the store fails to
/// write for another reason, recording stops: failure() says why, what was committed stays,
/// everything after counts as dropped, until a behavior begins again when no other runs.
/// Every method may be called from any thread. The store must outlive the recorder.
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
  /// To be told the time about ten times a second, so that clocks that are set are noticed.
  void look(const ClockReading& now);

  /// Starts a behavior whose `begin` is now; id, recording, robot (if empty) and end are filled in
  /// here. A behavior without parent belongs to the deepest running one whose tree path contains
  /// its own. Attempt 0 is counted: among this recorder's behaviors of that name, tree path and
  /// parent (1 without tree path and parent). Throws StoreError, also when recording has failed
  /// under behaviors that still run.
  Behavior begin(Behavior behavior, const RecordingTerms& terms = {});
  /// Topics that turned up later. Throws as end().
  void addTopics(std::int64_t behavior_id, const std::vector<std::string>& topics);
  /// Completes a behavior with what is known at its end: outcome, snapshot. It gets the files that
  /// its messages refer to (file_references.hpp); it may write to the store, and throw.
  using Completion = std::function<void(Behavior&, const std::set<std::string>& references)>;
  /// Waits until everything offered before is committed, then ends the behavior. Counts are right
  /// even if the recording failed meanwhile (see failure()). Throws std::logic_error for an id that
  /// does not run, StoreError if the end cannot be written.
  RecordedCounts end(std::int64_t behavior_id, Stamp end, const Completion& complete);
  RecordedCounts end(std::int64_t behavior_id, Stamp end, const std::string& outcome);
  /// Takes back a behavior that has ended: drops it and what no other covers.
  void discard(std::int64_t behavior_id);
  /// From now on nothing waits for a busy store: the program is about to end.
  void hurry();

  RecordedCounts counts(std::int64_t behavior_id) const;
  RecorderLoad load() const;
  /// What was noticed since the last call, for the log: clocks that were set.
  std::vector<std::string> takeNotices();
  /// Why nothing is recorded any more; empty while all is well, and while the store is busy.
  std::optional<std::string> failure() const;

 private:
  struct Queued {
    std::int64_t recording = 0;
    std::size_t channel_index = 0;
    std::size_t size = 0;  ///< what it counts in the queue
    Message message;
  };
  struct StoreChannel {
    std::int64_t id = 0;
    std::optional<Schema> schema;
    std::shared_ptr<const FileReferences> references;  ///< null: its type refers to none
  };
  using ChannelKey = std::pair<std::int64_t, std::size_t>;          ///< recording, channel index
  using References = std::map<std::string, std::set<std::size_t>>;  ///< by URI: places in a batch
  /// What a batch was seen to be on its way to the store; places in it.
  struct Batch {
    std::vector<Message> messages;
    std::vector<std::size_t> places;  ///< of the messages
    References references;
    std::set<std::size_t> unfit;
    std::map<std::size_t, std::string> refused;  ///< and why
  };
  enum class Want { No, LeftOut, Yes };

  bool covers(const RunningBehavior& running, const std::string& topic, Stamp received) const {
    return running.isWithin(received) && (running.isOwn(topic) || context_.count(topic) != 0 ||
                                          running.answers().count(topic) != 0);
  }
  Stamp orderly(Stamp clock);
  void notice(const std::string& text);
  Want wants(const std::string& topic, Stamp received);
  void enqueue(std::size_t channel_index, Message message);
  void drop(const Queued& queued);
  void enqueuePast(const RunningBehavior& running);
  /// What begin() does before and after the store gave the behavior its id.
  std::int64_t admit(Behavior& behavior, const RecordingTerms& terms);
  void rename(std::int64_t from, std::int64_t to);
  std::int64_t enclosing(const std::string& tree_path) const;
  int nextAttempt(const Behavior& behavior);
  void retire(std::int64_t behavior_id);
  RunningBehavior& running(std::int64_t behavior_id);
  void flush(std::unique_lock<std::mutex>& lock);
  void writeLoop();
  void write(std::unique_lock<std::mutex>& lock, std::deque<Queued> batch);
  std::map<ChannelKey, const Channel*> newChannels(const std::deque<Queued>& batch) const;
  void addChannels(const std::map<ChannelKey, const Channel*>& new_channels);
  Batch lookAt(std::deque<Queued>& batch) const;
  void appendToStore(Batch& batch);
  void count(const std::deque<Queued>& batch, const Batch& seen);
  void insist(const std::function<void()>& work);
  bool waitForStore(const std::string& why_busy);

  Store& store_;
  const RecorderOptions options_;
  const std::set<std::string> context_;

  std::mutex rows_mutex_;  ///< behaviors' rows are changed one by one; locked before mutex_
  mutable std::mutex mutex_;
  std::condition_variable to_writer_, from_writer_;
  std::int64_t recording_;        ///< the store's number for this run
  std::deque<Channel> channels_;  ///< by channel index; only grows
  PreRoll past_;
  std::map<std::int64_t, RunningBehavior>
      running_;                ///< by the store's id; below 0 until the store knows it
  std::int64_t unstored_ = 0;  ///< how many had an id below 0 so far
  /// By parent, tree path and name: the attempts so far.
  std::map<std::tuple<std::int64_t, std::string, std::string>, int> attempts_;
  std::deque<Queued> queue_;
  std::size_t queued_bytes_ = 0;
  std::uint64_t next_sequence_ = 0;
  std::uint64_t enqueued_ = 0, done_ = 0;  ///< messages; done: committed or given up
  RecorderLoad load_;
  Stamp last_;                 ///< no later stamp was given
  std::int64_t ahead_ns_ = 0;  ///< how far stamps are ahead of the clock
  bool went_back_ = false;     ///< the clock, in this recording
  ClockWatch clock_watch_;
  std::vector<std::string> notices_;
  bool is_flushing_ = false, is_closing_ = false;
  bool is_busy_ = false;     ///< the store, when it was last asked
  bool is_hurried_ = false;  ///< it is not waited for
  std::optional<std::string> failure_;

  std::map<ChannelKey, StoreChannel> store_channels_;  ///< the writer's
  std::thread writer_;                                 ///< last: it uses all of the above
};

}  // namespace afterglow::replay
