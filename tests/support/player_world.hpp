/// \file
/// Replays in a world of one store, a clock that jumps and a sink that remembers.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "replay/play/player.hpp"
#include "replay/record/snapshot.hpp"
#include "tests/support/faulty_store.hpp"
#include "tests/support/jumping_clock.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::test {

using namespace replay;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kBegin = 1'600'000'000'000'000'000;

inline const Channel kCmdVel = twistChannel("/cmd_vel");
inline const Channel kArm = trajectoryGoalChannel("/arm/follow_joint_trajectory/goal");
inline const Channel kGripper =
    channelOf("/gripper/goal", "my_msgs/CloseActionGoal",
              withTypes("Header header\nactionlib_msgs/GoalID goal_id\n", "std_msgs/Header",
                        kHeader, "actionlib_msgs/GoalID", kGoalId));
inline const Channel kCloud = cloudChannel("/points");
inline const Channel kMarkers = markersChannel("/markers");
inline const Channel kSay = textChannel("/robotsound");

/// "<action>/result" of a goal's channel.
inline Channel resultChannel(const Channel& goal) {
  return channelOf(goal.topic.substr(0, goal.topic.rfind('/')) + "/result",
                   "my_msgs/AnyActionResult", kAnyActionResult);
}

/// `status` as actionlib_msgs/GoalStatus has it.
inline Bytes resultMessage(const std::string& id, std::uint8_t status) {
  const Channel channel = channelOf("/any/result", "my_msgs/AnyActionResult", kAnyActionResult);
  Value message = blank(channel);
  at(message, "status.goal_id.id") = id;
  at(message, "status.status") = status;
  return encode(schemaOf(channel), message);
}

struct Sent {
  std::int64_t at_ms;  ///< since the first deadline
  std::string topic;
  Bytes bytes;
  Channel channel = {};
};

/// Remembers what was sent and when; may fail, and may act like a slow network.
class SpySink : public MessageSink {
 public:
  explicit SpySink(JumpingClock& clock) : clock_(clock), start_(clock.now().after(5 * kMs)) {}
  bool publish(const Channel& channel, const Bytes& bytes) override {
    sent.push_back({(clock_.now().ns - start_.ns) / kMs, channel.topic, bytes, channel});
    if (on_publish) on_publish(sent.back());
    const auto heard = is_heard_on.find(channel.topic);
    return heard == is_heard_on.end() ? is_heard : heard->second;
  }
  std::vector<Sent> on(const std::string& topic) const {
    std::vector<Sent> found;
    for (const Sent& message : sent) {
      if (message.topic == topic) found.push_back(message);
    }
    return found;
  }
  std::vector<std::int64_t> times(const std::string& topic) const {
    std::vector<std::int64_t> found;
    for (const Sent& message : on(topic)) found.push_back(message.at_ms);
    return found;
  }

  std::vector<Sent> sent;
  bool is_heard = true;
  std::map<std::string, bool> is_heard_on;  ///< topics that are another way
  std::function<void(const Sent&)> on_publish;

 private:
  JumpingClock& clock_;
  SteadyTime start_;
};

struct PlayerWorld : testing::Test {
  void record(const Channel& channel, std::int64_t at_ms, Bytes bytes) {
    Message message;
    message.channel = store->addChannel(recording, channel);
    message.received = {kBegin + at_ms * kMs};
    message.sequence = sequence++;
    message.bytes = std::move(bytes);
    store->append({message});
    if (std::find(topics.begin(), topics.end(), channel.topic) == topics.end()) {
      topics.push_back(channel.topic);
    }
  }

  /// Context of the recording, as the recorder keeps it: no topic of the behavior's own.
  void recordResult(const Channel& goal, std::int64_t at_ms, const std::string& id,
                    std::uint8_t status = 3) {
    const std::vector<std::string> own = topics;
    record(resultChannel(goal), at_ms, resultMessage(id, status));
    topics = own;
  }

  /// The robot ends each goal so long after it was sent, with a status; the n-th goal by the n-th.
  void actFor(std::vector<std::int64_t> durations_ms, std::uint8_t status = 3) {
    sink.on_publish = [this, durations_ms, status,
                       next = std::size_t{0}](const Sent& sent) mutable {
      if (sent.topic != kArm.topic || next == durations_ms.size()) return;
      clock.at(clock.now().after(durations_ms[next++] * kMs),
               [this, status, id = goalId(sent.bytes)] { player->onGoalStatus(id, status); });
    };
  }

  PlayReport play(
      std::int64_t length_ms, const std::string& only = "",
      const std::function<void()>& once_planned = [] {}) {
    Behavior behavior;
    behavior.recording = recording;
    behavior.name = "pick";
    behavior.begin = {kBegin};
    behavior.end = Stamp{kBegin + length_ms * kMs};
    behavior.topics = topics;
    plan_options.only = parseModalities(only);
    plan_options.is_motion_allowed = true;
    plan_options.settled = topicNames(topics);  // whatever is recorded here is meant to be played
    Snapshot snapshot;
    snapshot.requested = topics;
    behavior.snapshot = snapshot.toJson();
    behavior.id = store->addBehavior(behavior);
    plan = makePlan(*store, behavior, plan_options);
    once_planned();
    // ROS time is read a little later each time, as on a machine with other things to do.
    const auto ros_now = [this] { return Stamp{clock.now().ns + kBegin * 2 + 1000 * ++asked}; };
    player = std::make_unique<Player>(*store, plan, options, sink, clock, ros_now,
                                      [this] { return "fresh-" + std::to_string(++ids); });
    return player->run();
  }

  /// At a moment of the replay.
  void at(std::int64_t ms, std::function<void()> hook) {
    clock.at(clock.now().after((ms + 5) * kMs), std::move(hook));
  }

  std::unique_ptr<FaultyStore> store = std::make_unique<FaultyStore>();
  std::int64_t recording = store->addRecording({0, "", "test", ""});
  std::uint64_t sequence = 0;
  std::vector<std::string> topics;
  JumpingClock clock;
  SpySink sink{clock};
  PlanOptions plan_options;
  PlayOptions options;
  PlayPlan plan;
  std::unique_ptr<Player> player;
  int ids = 0, asked = 0;
};

using Times = std::vector<std::int64_t>;

}  // namespace afterglow::test
