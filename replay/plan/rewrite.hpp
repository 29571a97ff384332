/// \file
/// Rewrites a recorded message so that it can be published now: its stamps, its goal id, the start
/// of its trajectory, its frames; by the rules of rewrite_rules.hpp.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/plan/rewrite_rules.hpp"

namespace afterglow::replay {

/// The moment at which a message is published.
struct PublishMoment {
  Stamp now;                  ///< ROS time
  std::int64_t shift_ns = 0;  ///< added to recorded stamps; 0: they stay as they were
};

struct Rewritten {
  /// False for the cancel of a goal that was not sent this time: the server would remember it. Any
  /// other cancel names one goal of this replay.
  bool publish = true;
  /// The id that an action goal was given, by which the server tells of it; empty for others.
  std::optional<std::string> goal;
  std::string canceled;  ///< the new id of the goal that it cancels; empty: it is no cancel
};

/// Rewrites the messages of one replay, in the order they are sent; remembers its goals, so that
/// recorded cancels find them. Not thread-safe.
class Rewriter {
 public:
  /// A source of ids that were never used before.
  using FreshId = std::function<std::string()>;

  explicit Rewriter(FreshId fresh_id, RewriteSettings settings = {});
  ~Rewriter();

  /// The rules for the messages of this channel, with the counts of its topic so far. Throws
  /// MessageError if its definition cannot be understood, std::invalid_argument if the settings do
  /// not fit it.
  std::vector<RewrittenField> rules(const Channel& channel);

  /// Changes `bytes`. Throws MessageError if they do not fit the channel's definition or a stamp
  /// leaves the range of ROS time; they are not to be published then.
  [[nodiscard]] Rewritten rewrite(const Channel& channel, const PublishMoment& moment,
                                  Bytes& bytes);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Ids "<node>-<random, per generator>-<counter>".
Rewriter::FreshId uniqueGoalIds(const std::string& node);

}  // namespace afterglow::replay
