/// \file
/// The messages of a replay in the order they are due, those of a modality with a latency earlier
/// than the others.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "replay/plan/modality_options.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/play/prefetch.hpp"

namespace afterglow::replay {

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
    std::int64_t early_ns;  ///< its latency, in recorded time
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
