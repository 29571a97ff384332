/// \file
/// Behaviors while they are recorded: which messages belong to them, and how many were stored.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "replay/record/topic_choice.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Returns the other topics of an action's goals (actionlib): "/arm/result" and "/arm/cancel" for
/// "/arm/goal"; empty for a topic that is no goal's.
std::vector<std::string> goalTopics(const std::string& topic);

/// Counts of a behavior's messages that were stored so far.
struct RecordedCounts {
  std::uint64_t stored = 0;                ///< committed to the store; without context topics
  std::map<std::string, std::uint64_t> stored_on;  ///< the same by topic; without silent ones
  std::uint64_t dropped = 0;               ///< arrived, but could not be kept; context topics, too
  std::vector<std::string> silent_topics;  ///< said nothing, and held no latched message
  std::vector<std::string> remarks;        ///< see Behavior::remarks
};

/// Not thread-safe.
class RunningBehavior {
 public:
  RunningBehavior(Behavior behavior, const std::vector<TopicLimit>& limits);

  const Behavior& behavior() const { return behavior_; }
  /// The behavior with the remarks so far, for the store.
  Behavior written() const;
  void setId(std::int64_t id) { behavior_.id = id; }
  void setEnd(Stamp end) { behavior_.end = end; }
  /// False if the topic was its own already.
  bool addTopic(const std::string& topic);

  bool isOwn(const std::string& topic) const { return topics_.count(topic) != 0; }
  /// Results and cancels of its goals: context that a replay needs, which waits where the robot had
  /// waited, and cancels what was canceled.
  const std::set<std::string>& answers() const { return answers_; }
  bool isWithin(Stamp received) const {
    return received >= behavior_.begin && (!behavior_.end || received < *behavior_.end);
  }
  /// Returns true if it keeps this message; asked once for each message it covers: limits count.
  bool keeps(const std::string& topic, Stamp received);

  void countStored(const std::string& topic, Stamp received);
  void countDropped(const std::string& topic, const std::string& why);
  /// A message whose bytes do not fit its type; it is stored as it is.
  void countUnfit(const std::string& topic) { ++unfit_[topic]; }
  /// A message that no store takes.
  void countRefused(const std::string& topic, const std::string& why);
  void remark(const std::string& text);
  /// Keeps a reference; very many are cut to the first.
  void refer(const std::string& uri);
  const std::set<std::string>& references() const { return references_; }
  RecordedCounts counts() const;
  /// The behavior that reaches to its last stored message only, as no more could be written.
  void cutShort() { behavior_.end = Stamp{last_stored_.ns + 1}; }

 private:
  std::vector<std::string> remarks() const;

  Behavior behavior_;
  std::set<std::string> topics_, answers_, heard_, references_;
  std::map<std::string, TopicThinner> thinners_;
  struct Dropped {
    std::uint64_t count = 0;
    std::string why;  ///< the last reason
  };
  std::map<std::string, Dropped> dropped_, refused_;
  std::map<std::string, std::uint64_t> unfit_;
  std::uint64_t unkept_references_ = 0;
  std::map<std::string, std::uint64_t> stored_on_;
  std::uint64_t stored_ = 0;
  Stamp last_stored_;
  std::vector<std::string> remarks_;
};

/// The behaviors that run, overlapping or nested. Not thread-safe.
class RunningBehaviors {
 public:
  enum class Want { No, LeftOut, Yes };

  /// Context topics belong to every behavior's messages without being its own.
  explicit RunningBehaviors(const std::vector<std::string>& context_topics)
      : context_(context_topics.begin(), context_topics.end()) {}

  bool empty() const { return by_id_.empty(); }
  /// Fills in parent (the deepest running one whose tree path contains its own) and attempt where
  /// they are 0. The id is a provisional one, below 0, until rename().
  std::int64_t add(Behavior& behavior, const std::vector<TopicLimit>& limits);
  void rename(std::int64_t provisional, std::int64_t id);
  void remove(std::int64_t id);
  /// Throws std::logic_error if it does not run.
  RunningBehavior& at(std::int64_t id);
  const RunningBehavior* find(std::int64_t id) const;  ///< null if it does not run

  /// Returns whether a message is to be stored. LeftOut: behaviors cover it, and their limits leave
  /// it out. To be asked once for each message: limits count.
  Want wants(const std::string& topic, Stamp received);
  /// Calls work(RunningBehavior&) for every behavior that covers this message.
  template <typename Work>
  void forCovering(const std::string& topic, Stamp received, const Work& work) {
    for (auto& [id, running] : by_id_) {
      if (covers(running, topic, received)) work(running);
    }
  }
  void remark(const std::string& text);
  /// The topics of all messages that a behavior covers: its own, its goals' results and cancels,
  /// the context.
  std::set<std::string> topicsOf(const RunningBehavior& running) const;

 private:
  bool covers(const RunningBehavior& running, const std::string& topic, Stamp received) const;
  std::int64_t enclosing(const std::string& tree_path) const;
  int nextAttempt(const Behavior& behavior);

  const std::set<std::string> context_;
  std::map<std::int64_t, RunningBehavior> by_id_;
  std::int64_t added_ = 0;
  /// The attempts so far, by parent, tree path and name.
  std::map<std::tuple<std::int64_t, std::string, std::string>, int> attempts_;
};

}  // namespace afterglow::replay
