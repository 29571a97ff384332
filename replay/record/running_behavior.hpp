/// \file
/// A behavior while it is recorded: what it takes, and what became of it.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "replay/record/topic_limit.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// What became of a behavior's messages so far.
struct RecordedCounts {
  std::uint64_t stored = 0;                ///< committed to the store; without context topics
  std::uint64_t dropped = 0;               ///< arrived, but could not be kept; context topics, too
  std::vector<std::string> silent_topics;  ///< said nothing, and held no latched message
  std::vector<std::string> remarks;        ///< as Behavior::remarks
};

/// Not thread-safe.
class RunningBehavior {
 public:
  RunningBehavior(Behavior behavior, const std::vector<TopicLimit>& limits);

  const Behavior& behavior() const { return behavior_; }
  /// The behavior with the remarks so far: what is to be stored.
  Behavior written() const;
  void setId(std::int64_t id) { behavior_.id = id; }
  void setEnd(Stamp end) { behavior_.end = end; }
  /// False if the topic was its own already.
  bool addTopic(const std::string& topic);

  bool isOwn(const std::string& topic) const { return topics_.count(topic) != 0; }
  /// Results of its goals: context that a replay needs, which waits where the robot had waited.
  const std::set<std::string>& answers() const { return answers_; }
  bool isWithin(Stamp received) const {
    return received >= behavior_.begin && (!behavior_.end || received < *behavior_.end);
  }
  /// To be asked once for each message it covers: limits count.
  bool keeps(const std::string& topic, Stamp received);

  void countStored(const std::string& topic);
  void countDropped(const std::string& topic);
  /// A message whose bytes are none of its type; it is kept as it is.
  void countUnfit(const std::string& topic) { ++unfit_[topic]; }
  /// A message that no store takes.
  void countRefused(const std::string& topic, const std::string& why);
  void remark(const std::string& text);
  /// Of very many only the first are kept.
  void refer(const std::string& uri);
  const std::set<std::string>& references() const { return references_; }
  RecordedCounts counts() const;
  /// Why messages were dropped, if not for want of speed.
  void setReason(const std::string& why_dropped) { why_dropped_ = why_dropped; }

 private:
  std::vector<std::string> remarks() const;

  Behavior behavior_;
  std::set<std::string> topics_, answers_, heard_, references_;
  std::map<std::string, TopicThinner> thinners_;
  std::map<std::string, std::uint64_t> dropped_, unfit_, refused_;
  std::string why_refused_;  ///< the last one
  std::uint64_t unkept_references_ = 0;
  std::uint64_t stored_ = 0;
  std::vector<std::string> remarks_;
  std::string why_dropped_ = "they came faster than the store could write";
};

}  // namespace afterglow::replay
