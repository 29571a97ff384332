// What a session refuses, and does not know, without a master.
#include "nodes/player/rehearsal.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/player/replay_session.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::nodes::rehearsal_test {
namespace {

using Texts = std::vector<std::string>;

constexpr std::int64_t kMs = 1'000'000;

/// A behavior on a map, of a message on each of these topics.
struct Rehearsed {
  explicit Rehearsed(const std::vector<replay::Channel>& channels) {
    const std::int64_t recording = store->addRecording({0, "", "test", ""});
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.name = "pick";
    behavior.end = replay::Stamp{1000 * kMs};
    replay::Snapshot snapshot;
    snapshot.map = "the map";
    replay::Message message;
    for (const replay::Channel& channel : channels) {
      message.channel = store->addChannel(recording, channel);
      message.received = {700 * kMs};
      message.sequence++;
      message.bytes = channel.topic == "/cmd_vel" ? test::twist(0.2)
                      : channel.topic == "/said"  ? test::text("hello")
                                                  : test::markers(1);
      store->append({message});
      behavior.topics.push_back(channel.topic);
    }
    snapshot.requested = behavior.topics;
    behavior.snapshot = snapshot.toJson();
    request.behavior = std::to_string(store->addBehavior(behavior));
    request.allow_motion = true;
  }
  Rehearsal rehearsal() const {
    return ReplaySession(*store, request).rehearse(false, [] { return false; });
  }
  bool needsMap() const {
    for (const std::string& one : rehearsal().unchecked) {
      if (one == "whether the map is the recorded one") return true;
    }
    return false;
  }

  std::unique_ptr<replay::Store> store = replay::openMemoryStore();
  ReplayRequest request;
};

const replay::Channel kDrive = test::twistChannel("/cmd_vel");
const replay::Channel kLight = test::markersChannel("/projection/markers");
const replay::Channel kText = test::textChannel("/said");

TEST(Rehearsal, namesWhatIsOnlyKnownWithAMaster) {
  Rehearsed drive({kDrive});
  const Texts whole = {"who publishes the same", "whether the map is the recorded one",
                       "who hears the robot's topics",
                       "where the base is now and what its scan sees",
                       "whether it stands as it did"};
  EXPECT_EQ(drive.rehearsal().unchecked, whole);
  drive.request.body.start = BodyOptions::Start::Anywhere;
  drive.request.body.is_any_map_right = true;
  drive.request.body.stops.emergency_stop.topic = "/estop";
  EXPECT_EQ(drive.rehearsal().unchecked,
            (Texts{"who publishes the same", "who hears the robot's topics",
                   "the emergency stop /estop", "where the base is now and what its scan sees"}));
  Rehearsed light({kLight});
  light.request.body.is_any_map_right = true;
  EXPECT_EQ(light.rehearsal().unchecked, Texts{"who publishes the same"});
  light.request.everything = true;
  EXPECT_EQ(light.rehearsal().unchecked,
            (Texts{"who publishes the same", "whether a robot is live there"}));
}

TEST(Rehearsal, needsTheMapForABaseThatFollowsPosesAndForLightThatIsAnchoredThere) {
  Rehearsed drive({kDrive}), light({kLight}), text({kText});
  EXPECT_TRUE(drive.needsMap());
  drive.request.body.base.is_open_loop = true;
  EXPECT_FALSE(drive.needsMap());
  text.request.plan.settled = {"/said"};
  EXPECT_FALSE(text.needsMap());
  EXPECT_TRUE(light.needsMap() || !light.rehearsal().refusals.empty());
  light.request.anchors.add("body");
  EXPECT_FALSE(light.needsMap());
}

TEST(Rehearsal, refusesAsTheReplayWould) {
  Rehearsed drive({kDrive});
  Texts refusals = drive.rehearsal().refusals;
  ASSERT_EQ(refusals.size(), 2u);
  EXPECT_EQ(refusals[0].find("the base cannot follow its recorded poses: "), 0u) << refusals[0];
  EXPECT_EQ(refusals[1].find("nothing sees what stands in the base's way"), 0u) << refusals[1];
  drive.request.body.base.is_open_loop = drive.request.body.base.scan.is_waived = true;
  EXPECT_EQ(drive.rehearsal().refusals, Texts{});
  drive.request.allow_motion = false;
  refusals = drive.rehearsal().refusals;
  ASSERT_EQ(refusals.size(), 1u);
  EXPECT_NE(refusals[0].find("motion is not allowed"), std::string::npos) << refusals[0];
  drive.request.only = "speech";
  refusals = drive.rehearsal().refusals;
  ASSERT_EQ(refusals.size(), 1u);
  EXPECT_NE(refusals[0].find("there is nothing to play of speech"), std::string::npos);
}

TEST(ReplaySession, playsABodyAtATenthToTenTimesItsRate) {
  Rehearsed drive({kDrive}), text({kText});
  text.request.plan.settled = {"/said"};
  const auto why = [](Rehearsed& rehearsed, double rate) -> std::string {
    rehearsed.request.options.rate = rate;
    try {
      const ReplaySession session(*rehearsed.store, rehearsed.request);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(why(drive, 0.1), "");
  EXPECT_EQ(why(drive, 0.099), "a body is played at rates from 0.1 to 10");
  EXPECT_NE(why(drive, 10), "a body is played at rates from 0.1 to 10");
  EXPECT_EQ(why(drive, 10.01), "a body is played at rates from 0.1 to 10");
  EXPECT_EQ(why(text, 20), "");
}

TEST(ReplaySession, isAskedBeforeItPlays) {
  Rehearsed drive({kDrive});
  ReplaySession session(*drive.store, drive.request);
  EXPECT_FALSE(session.isPaused());
  session.pause();
  EXPECT_TRUE(session.isPaused());
  EXPECT_FALSE(session.goesToStart());
  EXPECT_EQ(session.waitsFor(), "");
  EXPECT_EQ(session.progress().state, replay::PlayProgress::State::Idle);
  EXPECT_THROW(session.setRate(1), std::runtime_error) << "it does not play yet";
}

}  // namespace
}  // namespace afterglow::nodes::rehearsal_test
