/// \file
/// The messages of a replay in the order they are due, those of a modality with a latency earlier
/// than the others; read ahead, so that a slow disk is not heard in the timing.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "replay/plan/play_plan.hpp"
#include "replay/plan/topic_role.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Reads in one thread, for another one that takes. Holds at most `bytes` of messages, but always
/// at least one.
class Prefetch {
 public:
  Prefetch(std::unique_ptr<MessageCursor> cursor, std::size_t bytes);
  ~Prefetch();
  Prefetch(const Prefetch&) = delete;
  Prefetch& operator=(const Prefetch&) = delete;

  /// Waits until the memory is used or the end is read.
  void fill();
  /// The next message, waiting for the reader if need be; nullptr at the end or after cancel().
  /// Valid until pop(). Throws what the cursor threw, once everything read before is taken.
  const Message* front();
  /// The next message if it is read already.
  const Message* ready();
  Message pop();
  /// Any thread: front() returns from now on.
  void cancel();
  /// Ends the reading. The damaged messages among those read so far.
  std::vector<DamagedMessage> end();

 private:
  void readLoop();
  bool isFull() const { return !queue_.empty() && held_bytes_ >= bytes_; }

  std::unique_ptr<MessageCursor> cursor_;
  const std::size_t bytes_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Message> queue_;  ///< elements stay where they are while others come and go
  std::size_t held_bytes_ = 0;
  bool has_ended_ = false, is_canceled_ = false;
  std::exception_ptr problem_;
  std::thread reader_;  ///< last: it uses all of the above
};

/// A lane of its own for every latency: which lane's message is due first changes with the rate,
/// and a message that has to wait for the body must not keep back others. Used as Prefetch is.
class MessageLanes {
 public:
  /// The plan's played messages from `begin` on; `bytes` in all. The store outlives it.
  MessageLanes(const Store& store, const PlayPlan& plan, const ModalityLatency& latency,
               Stamp begin, std::size_t bytes);

  /// The message that is due next. Valid until pop().
  struct Next {
    const Message* message;
    std::int64_t early_ns;  ///< the latency, in recorded time
    Prefetch* lane;
    /// The recorded moment it is due at.
    Stamp due() const { return {message->received.ns - early_ns}; }
  };
  /// Returns the next message at this rate; what was recorded after the limit comes after all else.
  /// Empty at the end.
  std::optional<Next> front(double rate, std::optional<Stamp> limit);
  /// The same of what is read already.
  std::optional<Next> ready(double rate, std::optional<Stamp> limit);

  void fill();
  /// Any thread.
  void cancel();
  /// Ends the reading. The damaged messages among those read so far.
  std::vector<DamagedMessage> end();

 private:
  struct Lane {
    double latency_s;
    std::unique_ptr<Prefetch> messages;
  };
  std::optional<Next> next(double rate, std::optional<Stamp> limit,
                           const Message* (Prefetch::*look)());

  std::vector<Lane> lanes_;
};

/// Converts a latency to recorded time.
std::int64_t earlyNs(double latency_s, double rate);

}  // namespace afterglow::replay
