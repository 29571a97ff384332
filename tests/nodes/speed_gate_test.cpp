// Every way to a replay begins with a session, and no session begins with motion that its robot
// cannot do: no master is needed to say so.
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "nodes/player/replay_session.hpp"
#include "nodes/player/robot_file.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::nodes::speed_gate_test {
namespace {

/// A behavior of one velocity, replayed on a Fetch.
struct Velocity {
  std::unique_ptr<replay::Store> store = replay::openMemoryStore();
  ReplayRequest request;

  explicit Velocity(double forward) {
    const std::int64_t recording = store->addRecording({0, "", "test", ""});
    replay::Message message;
    message.channel = store->addChannel(recording, test::twistChannel("/cmd_vel"));
    message.received = {700'000'000};
    message.bytes = test::twist(forward);
    store->append({message});
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.name = "drive";
    behavior.end = replay::Stamp{1'000'000'000};
    behavior.topics = {"/cmd_vel"};
    request.behavior = std::to_string(store->addBehavior(behavior));
    request.allow_motion = true;
    request.body.robot = findRobotProfile("fetch");
  }
  std::string refusal() const {
    try {
      const ReplaySession session(*store, request);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
};

TEST(SpeedGate, refusesWhatAFetchCannotDoAtItsOwnRateWithAndWithoutLimits) {
  EXPECT_EQ(Velocity(0.9).refusal(), "");
  for (const double limit : {0., 0.5, 100.}) {
    for (const double speed : {5., 1e300}) {
      Velocity fast(speed);
      fast.request.body.limits.are_given = limit > 0;
      if (limit > 0) fast.request.body.limits.linear = limit;
      const std::string why = fast.refusal();
      EXPECT_EQ(why.find("/cmd_vel: linear velocity of "), 0u) << why;
      EXPECT_NE(why.find(limit == 0.5 ? "above the limit of 0.5" : "above the limit of 1"),
                std::string::npos)
          << why;
    }
  }
}

TEST(SpeedGate, isPassedAgainAtAnotherRate) {
  Velocity drive(0.9);
  drive.request.options.rate = 1.2;
  EXPECT_NE(drive.refusal().find("linear velocity of 1.08 m/s at rate 1.2"), std::string::npos)
      << drive.refusal();
  const Velocity slow(0.5);
  ReplaySession session(*slow.store, slow.request);
  EXPECT_THROW(session.setRate(3), std::runtime_error);
}

}  // namespace
}  // namespace afterglow::nodes::speed_gate_test
