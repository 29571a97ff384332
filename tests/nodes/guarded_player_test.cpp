// A player as its guard knows it: when its robot is stopped, by what, and what is said of it. No
// ROS is involved.
#include "nodes/guard/guarded_player.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "nodes/guard/machine_name.hpp"

namespace afterglow::nodes::guarded_player_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

replay::SteadyTime at(std::int64_t ms) { return {(1'000'000 + ms) * kMs}; }

/// A way to a robot that remembers the bytes of the stops.
struct PaperWay : StopWay {
  std::uint32_t heardBy() const override { return listeners; }
  void publish(const StopMessage& stop) override { stops.push_back(stop.bytes); }
  std::string objection() const override { return reason; }

  std::uint32_t listeners = 1;
  std::string reason;
  std::vector<std::vector<std::uint8_t>> stops;
};

/// A player of two outputs, on another machine unless it is said to be on this one.
struct Guarded {
  explicit Guarded(const std::string& machine = "another") {
    outputs.player = 7;
    outputs.name = "/player";
    outputs.machine = machine;
    outputs.version = 3;
    outputs.outputs = {{"/cmd_vel", "geometry_msgs/Twist", "md5", "", {1}},
                       {"/arm/cancel", "actionlib_msgs/GoalID", "md5", "", {2}}};
    player.know(outputs, {{"/cmd_vel", base}, {"/arm/cancel", arm}}, at(0));
  }
  GuardBeat hear(std::int64_t ms, std::vector<std::uint32_t> moving = {}) {
    GuardBeat beat;
    beat.player = 7;
    beat.count = ++count;
    beat.sent_ns = static_cast<std::uint64_t>(at(ms).ns);
    beat.patience_ms = patience_ms;
    beat.moving = std::move(moving);
    player.hear(beat, at(ms));
    return beat;
  }
  std::string stopped() const { return player.answer().stopped; }

  std::shared_ptr<PaperWay> base = std::make_shared<PaperWay>(), arm = std::make_shared<PaperWay>();
  GuardOutputs outputs;
  GuardedPlayer player;
  std::uint32_t count = 0, patience_ms = 300;
};

using Stops = std::vector<std::vector<std::uint8_t>>;

TEST(GuardedPlayer, isStoppedWhereItMovesOnceItWasSilentForItsPatience) {
  Guarded guarded;
  guarded.hear(0, {1});
  EXPECT_EQ(guarded.player.deadline(), at(300));
  EXPECT_FALSE(guarded.player.step(at(299)));
  EXPECT_FALSE(guarded.player.isBraking());
  EXPECT_TRUE(guarded.player.step(at(300)));
  EXPECT_TRUE(guarded.player.isBraking());
  EXPECT_EQ(guarded.arm->stops, Stops{{2}});
  EXPECT_TRUE(guarded.base->stops.empty()) << "it stood";
  EXPECT_EQ(guarded.player.account(),
            "the player was silent for more than 300 ms in motion (--longest-stall, ~longest_stall "
            "allows more): the robot is being stopped");
  EXPECT_FALSE(guarded.player.step(at(320))) << "said once";
  EXPECT_EQ(guarded.arm->stops.size(), 2u) << "and sent again: one may be lost";
  while (!guarded.player.isOver()) guarded.player.step(guarded.player.deadline());
  EXPECT_FALSE(guarded.player.isBraking());
}

TEST(GuardedPlayer, isStoppedWhenItAsksAndNotWhenItHasEnded) {
  Guarded asking;
  GuardBeat beat = asking.hear(0, {0});
  beat.stop = 1;
  asking.player.hear(beat, at(20));
  EXPECT_TRUE(asking.player.step(at(20)));
  EXPECT_EQ(asking.stopped(), "the player asked for it");
  EXPECT_EQ(asking.base->stops.size(), 1u);
  Guarded ending;
  beat = ending.hear(0, {0});
  beat.end = 1;
  ending.player.hear(beat, at(20));
  EXPECT_FALSE(ending.player.step(at(10'000)));
  EXPECT_TRUE(ending.player.isOver());
  EXPECT_EQ(ending.stopped(), "");
}

TEST(GuardedPlayer, isStoppedWhereAWayObjects) {
  Guarded guarded;
  guarded.hear(0, {0});
  guarded.arm->reason = "its robot does not hear";
  guarded.hear(20, {0});
  EXPECT_TRUE(guarded.player.step(at(20)));
  EXPECT_EQ(guarded.stopped(), "its robot does not hear");
}

TEST(GuardedPlayer, mayNameAnOutputThatIsNotKnown) {
  Guarded guarded;
  guarded.hear(0, {1, 2, 4'000'000'000});
  EXPECT_TRUE(guarded.player.step(at(300)));
  EXPECT_EQ(guarded.arm->stops.size(), 1u) << "and what is known is stopped";
  EXPECT_EQ(guarded.player.account().find("; nobody"), std::string::npos);
}

TEST(GuardedPlayer, isAnsweredWithWhatTheGuardKnowsOfIt) {
  Guarded guarded;
  guarded.base->listeners = 2;
  guarded.arm->listeners = 0;
  guarded.hear(500);
  EXPECT_EQ(guarded.player.answer().longest_gap_us, 0u) << "outputs are no beat";
  guarded.hear(530);
  guarded.hear(550);
  const GuardAnswer answer = guarded.player.answer();
  EXPECT_EQ(answer.player, 7u);
  EXPECT_EQ(answer.count, 3u);
  EXPECT_EQ(answer.version, 3u);
  EXPECT_EQ(answer.longest_gap_us, 30'000u);
  EXPECT_EQ(answer.patience_ms, 300u);
  EXPECT_EQ(answer.is_beside, 0);
  EXPECT_EQ(answer.heard_by, (std::vector<std::uint32_t>{2, 0}));
}

TEST(GuardedPlayer, isWaitedForASecondAtMostUnlessItIsBeside) {
  Guarded afar, beside(machineName()), unknown("");
  for (Guarded* guarded : {&afar, &beside, &unknown}) {
    guarded->patience_ms = 5000;
    guarded->hear(0, {0});
  }
  EXPECT_EQ(afar.player.answer().patience_ms, 1000u);
  EXPECT_EQ(afar.player.deadline(), at(1000));
  EXPECT_EQ(unknown.player.answer().is_beside, 0);
  ASSERT_FALSE(machineName().empty());
  EXPECT_EQ(beside.player.answer().is_beside, 1);
  EXPECT_EQ(beside.player.deadline(), at(5000));
}

TEST(GuardedPlayer, isAccountedForByWhoStillHearsItsStops) {
  Guarded guarded;
  guarded.hear(0, {0, 1});
  guarded.base->listeners = 0;
  EXPECT_TRUE(guarded.player.step(at(300)));
  const std::string account = guarded.player.account();
  EXPECT_NE(account.find(": the robot is being stopped; nobody hears the stop on /cmd_vel"),
            std::string::npos)
      << account;
  guarded.arm->listeners = 0;
  EXPECT_NE(guarded.player.account().find(
                ": the robot is NOT stopped; nobody hears the stop on /cmd_vel /arm/cancel"),
            std::string::npos)
      << guarded.player.account();
  Guarded unheard;
  unheard.arm->listeners = 0;
  unheard.hear(0, {1});
  EXPECT_TRUE(unheard.player.step(at(300)));
  EXPECT_EQ(unheard.player.account().find("; nobody"), std::string::npos)
      << "nobody ever did: " << unheard.player.account();
}

TEST(GuardedPlayer, isForgottenOnceItHasEndedOrAMinuteAfterItsLastWord) {
  Guarded silent;
  silent.hear(0);
  EXPECT_FALSE(silent.player.isGone(at(59'999)));
  EXPECT_TRUE(silent.player.isGone(at(60'000)));
  Guarded ended;
  GuardBeat beat = ended.hear(0);
  beat.end = 1;
  ended.player.hear(beat, at(20));
  EXPECT_TRUE(ended.player.isGone(at(20)));
  Guarded braked;
  braked.hear(0, {0});
  braked.player.step(at(60'000));
  EXPECT_FALSE(braked.player.isGone(at(60'000))) << "not while its robot is being stopped";
}

}  // namespace
}  // namespace afterglow::nodes::guarded_player_test
