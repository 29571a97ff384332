/// \file
/// What a robot's recording holds by topic and type, and who stood around it: for tests of plans.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "replay/plan/play_plan.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::test {

struct Around {
  std::set<std::string> publishers, subscribers;
};

/// A behavior on topics of these types, and who stood around them.
struct RecordedRobot {
  void add(const std::string& topic, const std::string& type, const Around& around = {}) {
    types[topic] = type;
    note(topic, type, around);
  }
  void note(const std::string& topic, const std::string& type, const Around& around) {
    if (!around.publishers.empty() || !around.subscribers.empty()) {
      snapshot.nodes[topic] = {type, around.publishers, around.subscribers};
    }
  }
  static replay::PlanOptions allowed() {
    replay::PlanOptions options;
    options.is_motion_allowed = true;
    return options;
  }
  replay::PlayPlan plan(const replay::PlanOptions& options = allowed()) const {
    const auto store = replay::openMemoryStore();
    replay::Behavior behavior;
    behavior.recording = store->addRecording({0, "", "test", ""});
    std::uint64_t sequence = 0;
    for (const auto& [topic, type] : types) {
      replay::Message message;
      message.channel = store->addChannel(behavior.recording,
                                          channelOf(topic, type, "string data\n"));
      message.received = {500};
      message.sequence = sequence++;
      message.bytes = replay::Bytes(4, 0);
      store->append({message});
      behavior.topics.push_back(topic);
    }
    behavior.name = "nested";
    behavior.end = replay::Stamp{1000};
    behavior.snapshot = snapshot.toJson();
    behavior.id = store->addBehavior(behavior);
    return replay::makePlan(*store, behavior, options);
  }

  std::map<std::string, std::string> types;
  replay::Snapshot snapshot;
};

inline std::string whyNot(const replay::PlayPlan& plan, const std::string& topic) {
  for (const replay::PlannedTopic& one : plan.topics) {
    if (one.channel.topic == topic) return one.why_not;
  }
  return "not planned";
}

}  // namespace afterglow::test
