/// \file
/// Reads messages ahead of the player, so that a slow disk is not heard in the timing.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

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

}  // namespace afterglow::replay
