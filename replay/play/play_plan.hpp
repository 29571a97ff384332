/// \file
/// What a replay will do, topic by topic, worked out before anything is published.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/play/rewrite.hpp"
#include "replay/play/topic_role.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct PlannedTopic {
  Channel channel;  ///< as the topic's first message came
  std::uint64_t count = 0;
  Modality modality = Modality::Ar;
  std::string why_not;  ///< empty: it is played
  std::vector<RewrittenField> rewrites;

  bool isPlayed() const { return why_not.empty(); }
};

struct PlayPlan {
  Behavior behavior;
  Stamp end;  ///< the behavior's; of one that never ended, its last message's
  std::vector<PlannedTopic> topics;

  std::int64_t durationNs() const { return end.ns - behavior.begin.ns; }
  std::vector<std::string> playedTopics() const;
  /// Those of the body that are played.
  std::vector<std::string> motionTopics() const;
};

/// "body,ar,speech", any of them; empty: all. Throws std::invalid_argument naming an unknown word.
std::set<Modality> parseModalities(const std::string& text);

/// Plays the behavior's own topics of these modalities, as far as they may be replayed. Throws
/// StoreError.
PlayPlan makePlan(const Store& store, const Behavior& behavior, const std::set<Modality>& only);

/// Commands a velocity that holds until the next one: geometry_msgs/Twist and TwistStamped.
bool isVelocity(const Channel& channel);

}  // namespace afterglow::replay
