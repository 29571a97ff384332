// Guards as their player sees them, by what they answer. No ROS is involved.
#include "nodes/player/watchdog.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "nodes/guard/machine_name.hpp"
#include "replay/motion/stops/patience.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::nodes::watchdog_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// What a guard was told, and what it answers next.
struct PaperGuard {
  std::vector<GuardOutputs> outputs;
  std::vector<GuardBeat> beats;
  GuardAnswer answer;
  bool is_open = true, is_sure = true;
};

class PaperWay : public GuardWay {
 public:
  explicit PaperWay(PaperGuard& guard) : guard_(guard) {}
  void send(const GuardOutputs& outputs) override { guard_.outputs.push_back(outputs); }
  void send(const GuardBeat& beat) override { guard_.beats.push_back(beat); }
  GuardAnswer answer() override { return guard_.answer; }
  bool isOpen() override { return guard_.is_open; }
  bool isSure() const override { return guard_.is_sure; }

 private:
  PaperGuard& guard_;
};

/// The watchdog of a player that may move a base, which two nodes hear.
struct Watched {
  explicit Watched(bool is_beside, bool is_sure = true, bool are_listeners_sure = true)
      : watchdog("the guard", std::make_unique<PaperWay>(guard),
                 {{{"/cmd_vel", {"/base", "/player"}}}, are_listeners_sure}) {
    guard.is_sure = is_sure;
    guard.answer.is_beside = is_beside ? 1 : 0;
    guard.answer.version = 1;
    guard.answer.heard_by = {2};
    watchdog.tellOutputs({{test::twistChannel("/cmd_vel"), test::twist(0)}});
  }
  bool isReadyAt(std::uint32_t count) {
    guard.answer.count = count;
    watchdog.listen();
    return watchdog.isReady();
  }
  void beat(std::uint32_t beats) {
    for (; beats > 0; --beats) watchdog.beat({}, 60 * kMs);
    watchdog.listen();
  }

  PaperGuard guard;
  Watchdog watchdog;
};

TEST(Watchdog, sendsWhatMovesAndHowPatientItIsToBe) {
  Watched watched(true);
  watched.watchdog.listen();
  watched.watchdog.beat({0}, 150 * kMs);
  watched.watchdog.beat({}, 60 * kMs);
  watched.watchdog.stop();
  watched.watchdog.end();
  const auto& beats = watched.guard.beats;
  ASSERT_EQ(beats.size(), 4u);
  EXPECT_EQ(beats[0].count, 1u);
  EXPECT_EQ(beats[0].patience_ms, 150u);
  EXPECT_EQ(beats[0].moving, std::vector<std::uint32_t>{0});
  EXPECT_GT(beats[0].sent_ns, 0u);
  EXPECT_EQ(beats[3].count, 4u);
  const auto signs = [](const GuardBeat& beat) { return std::pair<int, int>(beat.stop, beat.end); };
  EXPECT_EQ(signs(beats[1]), std::make_pair(0, 0));
  EXPECT_EQ(signs(beats[2]), std::make_pair(1, 0));
  EXPECT_EQ(signs(beats[3]), std::make_pair(0, 1));
  ASSERT_EQ(watched.guard.outputs.size(), 1u);
  const GuardOutputs& told = watched.guard.outputs[0];
  EXPECT_EQ(told.player, beats[0].player);
  EXPECT_EQ(told.machine, machineName());
  EXPECT_EQ(told.version, 1u);
  EXPECT_EQ(told.outputs.at(0).topic, "/cmd_vel");
  EXPECT_EQ(told.outputs.at(0).stop, test::twist(0));
}

TEST(Watchdog, isReadyOnceItHasAnsweredAndReachesAllThatHearTheOutputs) {
  Watched watched(true, true, false);
  EXPECT_FALSE(watched.isReadyAt(0)) << "no beat was answered";
  watched.guard.answer.version = 0;
  EXPECT_FALSE(watched.isReadyAt(1)) << "it does not know what to stop";
  watched.guard.answer.version = 1;
  watched.guard.answer.heard_by = {1};
  EXPECT_FALSE(watched.isReadyAt(1)) << "one is not connected, and may be dead";
  watched.guard.answer.heard_by = {};
  EXPECT_FALSE(watched.isReadyAt(1));
  watched.guard.answer.heard_by = {3};
  EXPECT_TRUE(watched.isReadyAt(1));
}

TEST(Watchdog, isMeasuredByTwentyBeatsOverANetwork) {
  Watched watched(false);
  watched.guard.answer.longest_gap_us = 120'000;
  EXPECT_FALSE(watched.isReadyAt(3));
  EXPECT_FALSE(watched.isReadyAt(22));
  EXPECT_TRUE(watched.isReadyAt(23));
  EXPECT_EQ(watched.watchdog.longestGapNs(), 120 * kMs);
  const std::int64_t measured = replay::patienceAfar(120 * kMs);
  EXPECT_GT(measured, 300 * kMs);
  EXPECT_EQ(watched.watchdog.patience(60 * kMs), measured);
  EXPECT_EQ(watched.watchdog.patience(measured + 1), measured + 1) << "what is asked for";
  EXPECT_EQ(watched.watchdog.patience(5000 * kMs), 1000 * kMs) << "a second at most";
  Watched beside(true);
  EXPECT_TRUE(beside.isReadyAt(1));
  EXPECT_EQ(beside.watchdog.patience(5000 * kMs), 5000 * kMs);
}

TEST(Watchdog, isLostWhenItLeavesHalfASecondOfBeatsUnansweredOrASecondAfar) {
  Watched beside(true);
  ASSERT_TRUE(beside.isReadyAt(1));
  beside.beat(26);
  EXPECT_EQ(beside.watchdog.whyLost(), "") << "25 are unanswered";
  beside.beat(1);
  EXPECT_EQ(beside.watchdog.whyLost(), "the guard does not answer");
  Watched afar(false);
  ASSERT_FALSE(afar.isReadyAt(1));
  ASSERT_TRUE(afar.isReadyAt(21));
  afar.beat(71);
  EXPECT_EQ(afar.watchdog.whyLost(), "");
  afar.beat(1);
  EXPECT_EQ(afar.watchdog.whyLost(), "the guard does not answer");
}

TEST(Watchdog, isLostWhenItHasStoppedTheRobotOrIsGone) {
  Watched watched(true);
  EXPECT_EQ(watched.watchdog.whyLost(), "");
  watched.guard.answer.stopped = "it was told to end";
  watched.watchdog.listen();
  EXPECT_EQ(watched.watchdog.whyLost(), "the guard stopped the robot: it was told to end");
  watched.guard.is_open = false;
  watched.watchdog.listen();
  EXPECT_EQ(watched.watchdog.whyLost(), "the guard stopped the robot: it was told to end")
      << "the first reason stays";
  Watched gone(true);
  gone.guard.is_open = false;
  gone.watchdog.listen();
  EXPECT_EQ(gone.watchdog.whyLost(), "the guard is gone");
}

TEST(Watchdog, tellsOutputsAtOnceWhereNoneIsLostAndSeldomWhereSomeAre) {
  const std::vector<replay::MotionMonitor::Output> changed = {
      {test::twistChannel("/cmd_vel"), test::twist(1)}};
  Watched sure(true);
  sure.watchdog.tellOutputs(changed);
  ASSERT_EQ(sure.guard.outputs.size(), 2u);
  EXPECT_EQ(sure.guard.outputs[1].version, 2u);
  EXPECT_EQ(sure.guard.outputs[1].outputs.size(), 1u);
  sure.watchdog.listen();
  EXPECT_EQ(sure.guard.outputs.size(), 2u) << "it will get to them";
  Watched unsure(true, false);
  unsure.watchdog.tellOutputs(changed);
  unsure.watchdog.listen();
  EXPECT_EQ(unsure.guard.outputs.size(), 1u) << "not before a tenth of a second";
}

TEST(Watchdog, isAskedAgainWhileItKnowsFewerListenersThanThereAreForSure) {
  Watched watched(true);
  watched.guard.answer.heard_by = {1};
  EXPECT_FALSE(watched.isReadyAt(1));
  ASSERT_EQ(watched.guard.outputs.size(), 2u);
  EXPECT_EQ(watched.guard.outputs[1].version, 2u) << "it looks again at another one";
  watched.guard.answer.version = 2;
  EXPECT_FALSE(watched.isReadyAt(2));
  EXPECT_EQ(watched.guard.outputs.size(), 2u) << "but not at once";
}

TEST(Guards, areNobodyElse) {
  const std::string own = ros::this_node::getName();
  EXPECT_FALSE(isAnother(own));
  EXPECT_FALSE(isAnother(own + "_guard"));
  EXPECT_FALSE(isAnother("/afterglow_guard"));
  EXPECT_TRUE(isAnother("/teleop"));
  EXPECT_FALSE(isGuard(own));
}

TEST(Ros2Listeners, areBridgesWithoutWhoseWatchNothingMoves) {
  RosGraph graph;
  graph.subscribers = {{"/cmd_vel", {"/base", "/bridge"}}, {"/arm/goal", {"/base"}}};
  graph.publishers = {{"/bridge/ros2_network", {"/bridge"}}};
  const auto listeners = ros2Listeners(graph, {"/cmd_vel", "/arm/goal"});
  ASSERT_EQ(listeners.size(), 1u);
  EXPECT_EQ(listeners.at("/cmd_vel"), std::set<std::string>{"/bridge"});
  EXPECT_EQ(whyUnwatched(graph, "/arm/goal"), "");
  EXPECT_EQ(whyUnwatched(graph, "/cmd_vel"),
            "/cmd_vel goes to a robot of ROS 2 over /bridge, and no /afterglow_ros2_watch runs "
            "there, which stops the robot when the bridge is gone (ros2.launch starts it)");
}

}  // namespace
}  // namespace afterglow::nodes::watchdog_test
