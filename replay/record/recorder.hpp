/// \file
/// The recorder's core: messages come in from any thread, and behaviors that run decide which of
/// them are kept. Its parts: stamps (RecordingClock), behaviors (RunningBehaviors), the last
/// seconds (PreRoll), the queue and the thread that writes (StoreWriter).
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/messages/definitions.hpp"
#include "replay/messages/message.hpp"
#include "replay/record/pre_roll.hpp"
#include "replay/record/recording_clock.hpp"
#include "replay/record/running_behavior.hpp"
#include "replay/record/store_writer.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct RecorderOptions {
  /// Bytes of messages that may wait for the store; more messages are dropped and counted.
  std::size_t queue_bytes = 256u << 20;
  /// The longest time that a message waits before its batch is committed.
  std::chrono::milliseconds batch_period{100};
  std::string source = "recorder";  ///< the store's name for this run
  std::string robot;
  /// Topics recorded along with every behavior, e.g. /tf.
  std::vector<std::string> context_topics;
  /// The time that a behavior can reach back, and the bytes of messages that are remembered for it.
  std::chrono::nanoseconds pre_roll{0};
  std::size_t pre_roll_bytes = 64u << 20;
  /// Definitions for publishers whose own is defective.
  FindDefinition find_definition = findInstalled();
};

/// The terms by which a behavior is recorded.
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
/// much they are ahead of the clock. When no behavior runs any more, a new recording is begun, with
/// true stamps. If a wall clock is set, ahead or back, stamps go on by the steady clock while
/// behaviors run.
///
/// While another program keeps the store busy, messages wait in the queue, begin() refuses, and
/// end() waits. A message whose bytes do not fit its type is kept, one that no store takes is left
/// out; either is counted in the behaviors' remarks. When the store fails to write for another
/// reason, recording stops: failure() says why, committed messages stay, later ones count as
/// dropped, until a behavior begins again when no other runs, in a new recording. A behavior whose
/// end could not be written ends at its last stored message: that is written when the store writes
/// again, and as its recording goes on with nothing, it holds if the recorder dies before.
/// Every method may be called from any thread. The store must outlive the recorder.
class Recorder {
 public:
  /// Throws StoreError if the store cannot be written.
  Recorder(Store& store, RecorderOptions options);
  /// Writes the queue and stops the thread. Behaviors that still run stay open in the store:
  /// end them first.
  ~Recorder() { writeUnended(); }
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// A number for this channel, for offer(); the same for equal channels, and, once there are 2000,
  /// for those that differ in their sender only: names of nodes that come and go have no end. A
  /// defective definition (mendDefinition()) is replaced; behaviors with the topic have a remark.
  std::size_t channelIndex(Channel channel);
  /// Takes a message; `received` is when it arrived, taken by the caller at once. Never waits for
  /// the store. A message for which there is no memory counts as dropped.
  /// `steady_ns`: the steady clock then, unless ROS time is a simulation's.
  void offer(std::size_t channel_index, Stamp received, Bytes bytes,
             std::optional<std::int64_t> steady_ns = {});
  /// Forgets latched messages of a topic: nobody listens to it any more.
  void forgetLatched(const std::string& topic);
  /// Takes the time about ten times a second, and before begin() and end(), so that clocks that are
  /// set are noticed.
  void look(const ClockReading& now);

  /// Starts a behavior whose `begin` is now; id, recording, robot (if empty) and end are filled in
  /// here. A behavior without parent belongs to the deepest running one whose tree path contains
  /// its own. Attempt 0 is counted: among this recorder's behaviors of that name, tree path and
  /// parent (1 without tree path and parent). Throws StoreError, also when recording has failed
  /// under behaviors that still run.
  Behavior begin(Behavior behavior, const RecordingTerms& terms = {});
  /// Topics that turned up later. Throws as end().
  void addTopics(std::int64_t behavior_id, const std::vector<std::string>& topics);
  /// Completes a behavior at its end with its outcome and snapshot. It gets the files that
  /// its messages refer to (file_references.hpp); it may write to the store, and throw.
  using Completion = std::function<void(Behavior&, const std::set<std::string>& references)>;
  /// Waits until everything offered before is committed, then ends the behavior. Counts are right
  /// even if the recording failed meanwhile (see failure()). Throws std::logic_error for an id that
  /// does not run, StoreError if the end cannot be written.
  RecordedCounts end(std::int64_t behavior_id, Stamp end, const Completion& complete);
  /// Takes back a behavior that has ended: drops it and the messages that no other covers.
  void discard(std::int64_t behavior_id);
  /// Ends waiting for a busy store from now on: the program is about to end.
  void hurry();

  RecordedCounts counts(std::int64_t behavior_id) const;
  RecorderLoad load() const;
  /// Sentences for the log since the last call: clocks that were set, a busy store.
  std::vector<std::string> takeNotices();
  /// Returns why nothing is recorded any more; empty while all is well, and while the store is
  /// busy.
  std::optional<std::string> failure() const;

 private:
  void take(const Channel& channel, Message message);
  Stamp stampOf(Stamp ros, std::optional<std::int64_t> steady_ns = {});
  void notice(const std::string& text);
  void enqueue(const Channel& channel, Message message);
  std::string whyNotTaken(std::size_t message_bytes) const;
  void writeUnended();
  void drop(const std::string& topic, Stamp received, const std::string& why);
  void enqueuePast(const RunningBehavior& running);
  void enqueueEarlierTransforms(Stamp begin, const std::set<std::string>& topics);
  /// The part of begin() before the store has given the behavior its id.
  std::int64_t admit(Behavior& behavior, const RecordingTerms& terms);
  void retire(std::int64_t behavior_id);
  void onWritten(const std::deque<QueuedMessage>& batch, const std::optional<std::string>& failure);
  void count(const QueuedMessage& written);

  Store& store_;
  const RecorderOptions options_;

  std::mutex rows_mutex_;  ///< behaviors' rows are changed one by one; locked before mutex_
  mutable std::mutex mutex_;
  std::int64_t recording_;        ///< the store's number for this run
  std::deque<Channel> channels_;  ///< channels by index; only grows
  std::map<std::string, std::string> mended_;  ///< remarks on definitions, by topic
  RecordingClock clock_;
  PreRoll past_;
  RunningBehaviors running_;
  std::uint64_t next_sequence_ = 0;
  RecorderLoad load_;
  std::vector<std::string> notices_;
  std::vector<Behavior> unended_;  ///< behaviors whose ends could not be written yet

  StoreRetry retry_;
  StoreWriter writer_;  ///< last: its thread uses all of the above
};

}  // namespace afterglow::replay
