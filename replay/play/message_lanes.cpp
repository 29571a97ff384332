#include "replay/play/message_lanes.hpp"

#include <cmath>
#include <map>
#include <string>
#include <tuple>

namespace afterglow::replay {

std::int64_t earlyNs(double latency_s, double rate) { return std::llround(latency_s * rate * 1e9); }

MessageLanes::MessageLanes(const Store& store, const PlayPlan& plan, const ModalityLatency& latency,
                           Stamp begin, std::size_t bytes) {
  std::map<double, std::vector<std::string>> topics;
  for (const PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed()) {
      topics[latencyOf(latency, topic.modality)].push_back(topic.channel.topic);
    }
  }
  for (const auto& [seconds, names] : topics) {
    lanes_.push_back({seconds, std::make_unique<Prefetch>(
                                   store.messages(plan.behavior, {names, begin, plan.end}),
                                   bytes / topics.size())});
  }
}

std::optional<MessageLanes::Next> MessageLanes::front(double rate, std::optional<Stamp> limit) {
  return next(rate, limit, &Prefetch::front);
}

std::optional<MessageLanes::Next> MessageLanes::ready(double rate, std::optional<Stamp> limit) {
  return next(rate, limit, &Prefetch::ready);
}

std::optional<MessageLanes::Next> MessageLanes::next(double rate, std::optional<Stamp> limit,
                                                     const Message* (Prefetch::*look)()) {
  const auto order = [&](const Next& next) {
    const Stamp received = next.message->received;
    return std::make_tuple(limit && received > *limit, next.due().ns, received.ns,
                           next.message->sequence);
  };
  std::optional<Next> first;
  for (const Lane& lane : lanes_) {
    if (const Message* message = (*lane.messages.*look)()) {
      const Next found{message, earlyNs(lane.latency_s, rate), lane.messages.get()};
      if (!first || order(found) < order(*first)) first = found;
    }
  }
  return first;
}

void MessageLanes::fill() {
  for (const Lane& lane : lanes_) lane.messages->fill();
}

void MessageLanes::cancel() {
  for (const Lane& lane : lanes_) lane.messages->cancel();
}

std::vector<DamagedMessage> MessageLanes::end() {
  std::vector<DamagedMessage> damaged;
  for (const Lane& lane : lanes_) {
    const std::vector<DamagedMessage> of_lane = lane.messages->end();
    damaged.insert(damaged.end(), of_lane.begin(), of_lane.end());
  }
  return damaged;
}

}  // namespace afterglow::replay
