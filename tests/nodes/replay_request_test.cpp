// What a request becomes: the robot's names, the plan, and what is refused of it. No master is
// asked.
#include "nodes/player/replay_request.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/player/robot_file.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::nodes::replay_request_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;
const replay::Channel kVelocities = test::twistChannel("/cmd_vel");
const replay::Channel kGoals =
    test::trajectoryGoalChannel("/arm_controller/follow_joint_trajectory/goal");
const replay::Channel kWords = test::textChannel("/robotsound");
const replay::Channel kCloud = test::cloudChannel("/projection/points");
const replay::Channel kEstop = test::channelOf("/estop", "std_msgs/Bool", "bool data\n");

/// A behavior of one message on each of these topics, replayed on a Fetch that may move.
struct Requested {
  explicit Requested(const std::vector<replay::Channel>& channels) {
    const std::int64_t recording = store->addRecording({0, "", "test", ""});
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.name = "pick";
    behavior.end = replay::Stamp{1000 * kMs};
    replay::Message message;
    for (const replay::Channel& channel : channels) {
      message.channel = store->addChannel(recording, channel);
      message.received = {700 * kMs};
      message.sequence++;
      message.bytes = channel.topic == "/cmd_vel"     ? test::twist(0.2)
                      : channel.topic == kGoals.topic ? test::goalMessage("id", {1})
                      : channel.topic == kCloud.topic ? test::cloud(1, message.received)
                      : channel.topic == "/estop"     ? replay::Bytes{0}
                                                      : test::text("hello");
      store->append({message});
      behavior.topics.push_back(channel.topic);
      snapshot.requested.push_back(channel.topic);
    }
    behavior.snapshot = snapshot.toJson();
    request.behavior = std::to_string(store->addBehavior(behavior));
    request.allow_motion = true;
    request.body.robot = findRobotProfile("fetch");
  }
  replay::PlayPlan plan() const { return planReplay(*store, request); }
  std::string refusal() const {
    try {
      plan();
      return "";
    } catch (const std::exception& error) {
      return error.what();
    }
  }

  replay::Snapshot snapshot;
  std::unique_ptr<replay::Store> store = replay::openMemoryStore();
  ReplayRequest request;
};

TEST(ReplayRequest, isRefusedWhereABodyWouldLoopHurryOrWaitForAConsumer) {
  Requested looping({kVelocities}), hasty({kVelocities}), waiting({kVelocities});
  EXPECT_EQ(looping.refusal(), "");
  looping.request.options.is_looping = true;
  EXPECT_EQ(looping.refusal(),
            "behavior 1 'pick' moves the robot (/cmd_vel): loops and haste are for light and "
            "speech only (ar,speech)");
  hasty.request.options.is_immediate = true;
  EXPECT_EQ(hasty.refusal(), looping.refusal());
  waiting.request.rate_control.topic = "/consumer";
  EXPECT_EQ(waiting.refusal(),
            "behavior 1 'pick' moves the robot (/cmd_vel): only light and speech (ar,speech) wait "
            "for /consumer");
  Requested speech({kWords});
  speech.request.options.is_looping = true;
  speech.request.rate_control.topic = "/consumer";
  EXPECT_EQ(speech.refusal(), "");
}

/// Why the emergency stop is not played though it is asked for by name; empty: it is.
std::string whyNotObeyed(const ReplayRequest& request, const Requested& recorded) {
  ReplayRequest asked = request;
  asked.plan.settled = {kEstop.topic};
  asked.body.robot = {};
  for (const replay::PlannedTopic& topic : planReplay(*recorded.store, asked).topics) {
    if (topic.channel.topic == kEstop.topic) return topic.why_not;
  }
  return "not planned";
}

TEST(ReplayRequest, playsNothingThatItsReplayObeys) {
  const Requested recorded({kVelocities, kEstop});
  ReplayRequest request = recorded.request;
  EXPECT_EQ(whyNotObeyed(request, recorded), "");
  request.body.stops.emergency_stop.topic = "/estop";
  EXPECT_NE(whyNotObeyed(request, recorded).find("the emergency stop"), std::string::npos);
  request = recorded.request;
  request.body.base.scan.topic = "/estop";
  EXPECT_NE(whyNotObeyed(request, recorded).find("the scan"), std::string::npos);
  request.body.base.scan.is_waived = true;
  EXPECT_EQ(whyNotObeyed(request, recorded), "");
  request.body.base.scan.is_waived = request.allow_motion = false;
  EXPECT_EQ(whyNotObeyed(request, recorded).find("the scan"), std::string::npos)
      << "nothing drives";
  const replay::Channel clock = test::channelOf("/clock", "rosgraph_msgs/Clock", "time clock\n");
  Requested timed({kVelocities, clock});
  timed.request.plan.settled = {"/clock"};
  const auto whyNoClock = [&] {
    for (const auto& topic : timed.plan().topics) {
      if (topic.channel.topic == "/clock") return topic.why_not;
    }
    return std::string("not planned");
  };
  EXPECT_EQ(whyNoClock().find("the clock"), std::string::npos);
  timed.request.clock = ReplayClock::Follow;
  EXPECT_NE(whyNoClock().find("the clock"), std::string::npos) << whyNoClock();
}

/// The topic that takes the base to the start; empty: none.
std::string wayOfBase(const Requested& requested) {
  for (const replay::PlannedTopic& topic : requested.plan().topics) {
    if (topic.is_for_start) return topic.output.topic;
  }
  return "";
}

TEST(ReplayRequest, takesTheBaseToTheStartWhereAnArmAloneWasRecorded) {
  Requested arm({kGoals}), drive({kVelocities, kGoals}), speech({kWords});
  for (Requested* requested : {&arm, &drive, &speech}) {
    EXPECT_EQ(wayOfBase(*requested), "");
    requested->request.body.start = BodyOptions::Start::MoveThere;
  }
  EXPECT_EQ(wayOfBase(arm), "/cmd_vel");
  EXPECT_EQ(wayOfBase(drive), "") << "that has a way of its own";
  EXPECT_EQ(wayOfBase(speech), "");
  drive.request.plan.exclude = {"/cmd_vel"};
  EXPECT_EQ(wayOfBase(drive), "") << "it was excluded";
  Requested other({kGoals, test::twistChannel("/base/cmd_vel")});
  other.request.body.start = BodyOptions::Start::MoveThere;
  other.request.plan.settled = {"/base/cmd_vel"};
  EXPECT_EQ(wayOfBase(other), "") << "the base is driven there already";
  arm.request.body.robot.base.velocity_topic.clear();
  EXPECT_EQ(wayOfBase(arm), "");
}

TEST(ReplayRequest, leadsElsewhereByAPrefixThatNoRobotIsLiveUnder) {
  const auto isElsewhere = [](const ReplayRequest& request) {
    return request.place() == replay::ReplayPlace::Elsewhere;
  };
  ReplayRequest request;
  EXPECT_FALSE(isElsewhere(request));
  request.plan.prefix = "/then";
  EXPECT_TRUE(isElsewhere(request));
  request.is_prefix_live = true;
  EXPECT_FALSE(isElsewhere(request));
  request.is_prefix_live = false;
  request.allow_motion = true;
  EXPECT_FALSE(isElsewhere(request)) << "another robot's, which may move";
  request.everything = true;
  EXPECT_TRUE(isElsewhere(request));
}

TEST(ReplayRequest, hasItsProfilesScanUnlessAnotherIsNamed) {
  Requested requested({kVelocities});
  EXPECT_EQ(forItsRobot(*requested.store, requested.request).body.base.scan.topic, "/base_scan");
  requested.request.body.base.scan.topic = "/scan";
  EXPECT_EQ(forItsRobot(*requested.store, requested.request).body.base.scan.topic, "/scan");
}

TEST(ReplayRequest, hasItsProfilesNamesBelowTheNamespaceOfItsRobot) {
  Requested requested({kVelocities});
  requested.request.robot_namespace = "/robot2";
  requested.request.body.stops.emergency_stop.topic = "/robot_state";
  const ReplayRequest own = forItsRobot(*requested.store, requested.request);
  EXPECT_EQ(own.body.robot.base.velocity_topic, "/robot2/cmd_vel");
  EXPECT_EQ(own.body.base.usual_topic, "/robot2/cmd_vel");
  EXPECT_EQ(own.body.stops.emergency_stop.topic, "/robot_state") << "an option named it";
  requested.request.body.stops.emergency_stop.profile = "fetch";
  EXPECT_EQ(forItsRobot(*requested.store, requested.request).body.stops.emergency_stop.topic,
            "/robot2/robot_state");
}

TEST(ReasonOf, addsTheReasonOfTheClassWhereThatIsAnotherOne) {
  replay::PlannedTopic topic;
  topic.why_class = "a robot's state";
  EXPECT_EQ(reasonOf(topic), "a robot's state") << "it is played";
  topic.why_not = "a robot's state";
  EXPECT_EQ(reasonOf(topic), "a robot's state");
  topic.why_not = "it was excluded";
  EXPECT_EQ(reasonOf(topic), "it was excluded (a robot's state)");
}

TEST(ReplayRequest, hasToLeaveSomethingToPlay) {
  Requested requested({kVelocities});
  EXPECT_NO_THROW(checkSomethingToPlay(requested.plan(), requested.request));
  requested.request.only = "speech";
  try {
    checkSomethingToPlay(requested.plan(), requested.request);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(
        std::string(error.what()).find("behavior 1 'pick': there is nothing to play of speech"), 0u)
        << error.what();
  }
}

TEST(CountRewrites, countsWhatIsShiftedUnlessTheRecordingsTimeIsPlayed) {
  Requested requested({kCloud});
  const auto shifted = [&](ReplayClock clock) {
    std::uint64_t count = 0;
    for (const auto& topic : countRewrites(*requested.store, requested.plan(), clock).topics) {
      for (const auto& field : topic.rewrites) {
        if (field.rule == replay::RewriteRule::ShiftStamp) count += field.count;
      }
    }
    return count;
  };
  EXPECT_EQ(shifted(ReplayClock::Live), 1u);
  EXPECT_EQ(shifted(ReplayClock::Sim), 0u);
}

}  // namespace
}  // namespace afterglow::nodes::replay_request_test
