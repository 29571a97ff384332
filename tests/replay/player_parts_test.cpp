// The parts of the player, each by itself.
#include <gtest/gtest.h>

#include "replay/motion/stops/motion_monitor.hpp"
#include "tests/support/player_world.hpp"

namespace afterglow::replay::player_parts_test {
namespace {

using namespace test;

constexpr SteadyTime kStart{1'000'000'000};

SteadyTime after(std::int64_t ms) { return kStart.after(ms * kMs); }
Stamp recordedAt(std::int64_t ms) { return {kBegin + ms * kMs}; }

/// The parts that stand below the scheduler, over ten seconds of a behavior.
struct PlayerParts : testing::Test {
  PlayerParts() {
    plan.behavior.begin = plan.begin = recordedAt(0);
    plan.end = recordedAt(10'000);
  }
  void plays(const Channel& channel, Modality modality) {
    PlannedTopic topic;
    topic.channel = topic.output = channel;
    topic.modality = modality;
    plan.topics.push_back(topic);
  }
  GoalBook::Entry goal(const std::string& id, std::int64_t at_ms, std::int64_t end_ms) const {
    GoalBook::Entry entry{kArm, goalMessage("recorded", {1}), recordedAt(at_ms), id};
    entry.milestone = Milestone{recordedAt(end_ms)};
    return entry;
  }
  void begin() {
    transport.enter(recordedAt(0), clock.now());
    ledger.begin(clock.now());
  }

  PlayPlan plan;
  PlayOptions options;
  JumpingClock clock;
  SpySink sink{clock};
  Milestones milestones;
  GoalBook goals;
  Transport transport{plan, options, clock};
  Ledger ledger{plan};
  PlayContext play{plan, options, clock, transport, ledger};
  StepGate gate{play, milestones, goals};
  ArmLead lead{play};
};

// ----------------------------------------------------------------------------------- the goal book

TEST(GoalBook, keepsAGoalOpenUntilItsCancelIsSent) {
  GoalBook goals;
  goals.open("/arm/goal", "a");
  goals.add("/arm/goal", {kArm, {}, recordedAt(0), "a"});
  EXPECT_TRUE(goals.hasOpen());
  EXPECT_EQ(goals.suspendOpen().size(), 1u);
  EXPECT_FALSE(goals.hasOpen()) << "it is not waited for";
  EXPECT_TRUE(goals.isOpen("/arm/goal")) << "but has to be stopped";
  goals.cancel("/gripper/goal", "a");
  EXPECT_TRUE(goals.isOpen("/arm/goal")) << "another action's";
  goals.cancel("/arm/goal", "a");
  EXPECT_FALSE(goals.isOpen("/arm/goal"));
  ASSERT_EQ(goals.takeSuspended().size(), 1u);
  EXPECT_EQ(goals.counts().sent, 0u) << "it is sent again";
}

TEST(GoalBook, tellsGoalsOfOneIdApartByTheirActions) {
  GoalBook goals;
  goals.open("/arm/goal", "a");
  goals.open("/gripper/goal", "a");
  goals.add("/gripper/goal", {kGripper, {}, recordedAt(0), "a"});
  EXPECT_EQ(goals.openOn(kGripper.topic).size(), 1u);
  goals.cancel("/arm/goal", "a");
  EXPECT_FALSE(goals.isOpen("/arm/goal"));
  EXPECT_TRUE(goals.isOpen("/gripper/goal"));
  EXPECT_TRUE(goals.hasOpen());
}

TEST(GoalEnd, tellsAbortedRejectedAndLostApartWithCodeAndText) {
  const std::string type = "control_msgs/FollowJointTrajectoryActionResult";
  const Channel channel =
      channelOf("/arm/result", type,
                kAnyActionResult.substr(0, kAnyActionResult.find('=')) +
                    "control_msgs/FollowJointTrajectoryResult result\n" +
                    kAnyActionResult.substr(kAnyActionResult.find('=')) +
                    withTypes("", "control_msgs/FollowJointTrajectoryResult",
                              "int32 error_code\nstring error_string\n"));
  const auto words = [&](std::uint8_t status, std::int32_t code, const char* said, const char* text) {
    Value message = blank(channel);
    at(message, "status.goal_id.id") = std::string("fresh");
    at(message, "status.status") = status;
    at(message, "status.text") = std::string(text);
    at(message, "result.error_code") = code;
    at(message, "result.error_string") = std::string(said);
    const auto [id, end] = readResult(type, channel.definition, encode(schemaOf(channel), message));
    EXPECT_EQ(id, "fresh");
    return end.words();
  };
  EXPECT_EQ(words(4, -4, "", ""), "was aborted (PATH_TOLERANCE_VIOLATED, -4)");
  EXPECT_EQ(words(5, -2, "arm_9 is unknown", "ask me"),
            "was rejected (INVALID_JOINTS, -2: arm_9 is unknown: ask me)");
  EXPECT_EQ(words(4, 7, "", "stuck"), "was aborted (error 7: stuck)");
  EXPECT_EQ(words(9, 0, "", ""), "was lost");
  EXPECT_EQ(words(3, 0, "", ""), "ended");
  EXPECT_EQ(words(2, 0, "", ""), "was canceled");
  EXPECT_EQ(words(8, -6, "", ""), "was canceled (error -6)");
  EXPECT_EQ(words(4, -5, "stuck", "stuck"), "was aborted (GOAL_TOLERANCE_VIOLATED, -5: stuck)")
      << "nothing is said twice";
  EXPECT_THROW(readResult(type, "string data\n", text("x")), MessageError) << "no result";
  const auto [id, other] = readResult("my_msgs/AnyActionResult", kAnyActionResult,
                                      resultMessage("a", 4));
  EXPECT_EQ(other.words(), "was aborted");
}

TEST(GoalOutcome, isOpenInEveryStateThatIsNotFinal) {
  for (const std::uint8_t status : {0, 1, 6, 7, 10, 255}) {
    EXPECT_EQ(outcomeOf(status), GoalOutcome::Open) << int{status};
  }
  for (const std::uint8_t status : {4, 5, 9}) EXPECT_EQ(outcomeOf(status), GoalOutcome::Failed);
  for (const std::uint8_t status : {2, 8}) EXPECT_EQ(outcomeOf(status), GoalOutcome::Canceled);
  EXPECT_EQ(outcomeOf(3), GoalOutcome::Succeeded);
}

GoalBook::Entry goalUntil(const std::string& id, std::int64_t end_ms,
                          GoalOutcome outcome = GoalOutcome::Succeeded) {
  GoalBook::Entry entry{kArm, {}, recordedAt(0), id};
  entry.milestone = Milestone{recordedAt(end_ms), outcome};
  return entry;
}

TEST(GoalBook, waitsForTheGoalThatEndedFirstAndNoLongerForWhatIsGivenUp) {
  GoalBook goals;
  goals.open("/head/goal", "not recorded");
  goals.add("/arm/goal", {kArm, {}, recordedAt(0), "of unknown end"});
  EXPECT_FALSE(goals.nextMilestone());
  goals.add("/arm/goal", goalUntil("late", 3000));
  goals.add("/arm/goal", goalUntil("soon", 1000));
  goals.add("/arm/goal", goalUntil("later", 2000));
  EXPECT_EQ(goals.nextMilestone()->second.at, recordedAt(1000));
  goals.giveUpWaiting(recordedAt(2000));
  EXPECT_EQ(goals.nextMilestone()->second.at, recordedAt(3000)) << "the moment itself is over";
  goals.giveUpWaiting(recordedAt(3000));
  EXPECT_FALSE(goals.nextMilestone());
  EXPECT_TRUE(goals.hasOpen()) << "they go on all the same";
}

TEST(GoalBook, cancelsWhatWasCanceledWhenItWasRecorded) {
  GoalBook goals;
  EXPECT_FALSE(goals.nextCanceled());
  goals.open("/head/goal", "not recorded");
  goals.add("/arm/goal", goalUntil("succeeded", 500));
  goals.add("/arm/goal", goalUntil("late", 3000, GoalOutcome::Canceled));
  goals.add("/arm/goal", goalUntil("soon", 1000, GoalOutcome::Canceled));
  EXPECT_EQ(goals.nextCanceled(), recordedAt(1000));
  const auto given_up = goals.giveUpCanceled(recordedAt(1000));
  ASSERT_EQ(given_up.size(), 1u);
  EXPECT_EQ(given_up[0].id, "soon");
  EXPECT_EQ(goals.nextCanceled(), recordedAt(3000));
  EXPECT_EQ(goals.counts().canceled, 1u);
  EXPECT_EQ(goals.openOn(kArm.topic).size(), 2u);
  EXPECT_TRUE(goals.openOn("/head/goal").empty()) << "nobody recorded that one";
  goals.cancel("/arm/goal", "");
  EXPECT_FALSE(goals.isOpen("/arm/goal")) << "an empty id cancels all";
  EXPECT_TRUE(goals.isOpen("/head/goal"));
  EXPECT_EQ(goals.counts().canceled, 3u);
}

TEST(GoalBook, countsEachGoalOnceByHowItEnded) {
  GoalBook goals;
  for (const char* id : {"a", "b", "c", "d"}) goals.add("/arm/goal", goalUntil(id, 1000));
  EXPECT_TRUE(goals.finish("a", GoalOutcome::Succeeded, after(1)));
  EXPECT_FALSE(goals.finish("a", GoalOutcome::Failed, after(2))) << "it has ended";
  EXPECT_TRUE(goals.finish("b", GoalOutcome::Failed, after(3)));
  EXPECT_TRUE(goals.finish("c", GoalOutcome::Canceled, after(4)));
  EXPECT_FALSE(goals.finish("unknown", GoalOutcome::Failed, after(5)));
  EXPECT_EQ(goals.suspendOpen().size(), 1u);
  EXPECT_EQ(goals.giveUp().size(), 0u) << "it is set aside, and was canceled then";
  const auto [sent, succeeded, failed, canceled] = goals.counts();
  EXPECT_EQ(sent, 4u);
  EXPECT_EQ(succeeded, 1u);
  EXPECT_EQ(failed, 1u);
  EXPECT_EQ(canceled, 2u);
  EXPECT_EQ(goals.takeEnded().size(), 3u);
  EXPECT_TRUE(goals.takeEnded().empty()) << "once";
}

TEST(GoalBook, tellsHowGoalsEndedThatWereNotRecorded) {
  GoalBook goals;
  goals.open("/arm/goal", "to-the-start");
  EXPECT_FALSE(goals.hasOpen());
  EXPECT_FALSE(goals.finish("to-the-start", GoalOutcome::Open, after(0)));
  EXPECT_EQ(goals.endOf("to-the-start").first, GoalOutcome::Open);
  EXPECT_FALSE(goals.finish("to-the-start", GoalOutcome::Failed, after(1)));
  EXPECT_EQ(goals.endOf("to-the-start").first, GoalOutcome::Failed);
  EXPECT_FALSE(goals.isOpen("/arm/goal"));
  EXPECT_TRUE(goals.takeEnded().empty());
  EXPECT_EQ(goals.counts().failed, 0u);
}

TEST(GoalBook, isTheOneThatTheWatchdogLooksInto) {
  PlayPlan plan;
  plan.topics.emplace_back();
  plan.topics.back().channel = plan.topics.back().output = kArm;
  MotionMonitor watch(plan);
  watch.sending(kArm, goalMessage("a", {1}));
  watch.goals().add(kArm.topic, {kArm, {}, recordedAt(0), "a"});
  ASSERT_EQ(watch.goals().giveUp().size(), 1u);
  const Outputs cancel_and_halt{0, 1};
  EXPECT_EQ(watch.moving(), cancel_and_halt);
  EXPECT_FALSE(watch.goalEnded("another one").has_changed);
  EXPECT_EQ(watch.moving(), cancel_and_halt) << "until its cancel is sent";
  watch.sending(cancelChannel(kArm), cancelMessage("a"));
  EXPECT_TRUE(watch.moving().empty());
}

// ---------------------------------------------------------------------------------- the transport

struct PlayerTransportPart : PlayerParts {};

TEST_F(PlayerTransportPart, givesRequestsOnceAndPausesUntilResumed) {
  begin();
  transport.setRate(2);
  transport.seek({3'000 * kMs});
  transport.pause();
  Transport::Orders orders = transport.takeOrders(true);
  EXPECT_TRUE(orders.pauses);
  EXPECT_EQ(orders.rate, 2.0);
  EXPECT_EQ(orders.seek, recordedAt(3000));
  transport.change([&](Timeline& timeline) { timeline.pause(clock.now()); });
  orders = transport.takeOrders(true);
  EXPECT_FALSE(orders.pauses || orders.resumes || orders.rate || orders.seek);
  transport.resume();
  EXPECT_TRUE(transport.takeOrders(true).resumes);
}

TEST_F(PlayerTransportPart, holdsOnlyWhileAMessageIsToCome) {
  begin();
  transport.hold(true);
  EXPECT_FALSE(transport.takeOrders(false).pauses);
  EXPECT_TRUE(transport.takeOrders(true).pauses);
}

TEST_F(PlayerTransportPart, stopsForTheFirstReasonAndForAFailingBody) {
  begin();
  transport.fail(Modality::Speech, "no loudspeaker");
  EXPECT_FALSE(transport.isStopped()) << "speech goes on";
  transport.fail(Modality::Body, "the arm is lost");
  transport.stop("somebody said so");
  EXPECT_EQ(transport.stopReason(), "body failed: the arm is lost");
  EXPECT_TRUE(transport.takeOrders(true).stops);
  EXPECT_EQ(transport.failures().at(Modality::Speech).first, "no loudspeaker");
}

TEST_F(PlayerTransportPart, pausesOnceBeforeEachMessageOfAPauseTopic) {
  begin();
  EXPECT_TRUE(transport.pausesBefore(7));
  EXPECT_FALSE(transport.pausesBefore(7));
  EXPECT_FALSE(transport.togglePauseTopics());
  EXPECT_FALSE(transport.pausesBefore(8));
}

// ---------------------------------------------------------------------------------- the step gate

struct PlayerStepGate : PlayerParts {
  PlayerStepGate() { begin(); }
};

TEST_F(PlayerStepGate, holdsTheTimelineUntilTheGoalHasEnded) {
  goals.add(kArm.topic, goal("a", 0, 2000));
  EXPECT_TRUE(gate.moveLimit(std::nullopt).has_moved);
  EXPECT_FALSE(gate.moveLimit(std::nullopt).has_moved) << "it has been told";
  EXPECT_EQ(transport.timeline().limit(), recordedAt(1950));
  clock.sleepUntil(after(1900));
  EXPECT_FALSE(gate.isHeldByGoal());
  clock.sleepUntil(after(1990));
  EXPECT_TRUE(gate.isHeldByGoal());
  EXPECT_FALSE(gate.stand().begins) << "the margin of 50 ms may do";
  clock.sleepUntil(after(2500));
  EXPECT_TRUE(gate.stand().begins);
  EXPECT_FALSE(gate.stand().begins) << "once";
  goals.finish("a", GoalOutcome::Succeeded, clock.now());
  const GoalBook::Ended ended = goals.takeEnded().at(0);
  ASSERT_TRUE(gate.isWaitedFor(ended.milestone));
  const StepGate::Move move = gate.moveLimit(ended);
  EXPECT_TRUE(move.has_moved);
  EXPECT_EQ(move.goes_on_from, recordedAt(1950));
  EXPECT_EQ(transport.timeline().recorded(clock.now()), recordedAt(2000)) << "it leaps there";
  const PlayReport report = ledger.report();
  ASSERT_EQ(report.in_step.waits.size(), 1u);
  EXPECT_EQ(report.in_step.waits[0].what, kArm.topic);
  EXPECT_NEAR(report.in_step.waits[0].seconds, 0.5, 1e-9);
}

TEST_F(PlayerStepGate, givesUpAGoalThatTakesTooLong) {
  options.goal_wait_s = 3;
  goals.add(kArm.topic, goal("a", 0, 2000));
  gate.moveLimit(std::nullopt);
  clock.sleepUntil(after(4900));
  EXPECT_EQ(gate.stand().too_long, "");
  clock.sleepUntil(after(5100));
  EXPECT_EQ(gate.stand().too_long,
            "a goal on /arm/follow_joint_trajectory/goal took 3 s longer than it did when it was "
            "recorded");
  EXPECT_TRUE(gate.moveLimit(std::nullopt).has_moved);
  EXPECT_EQ(transport.timeline().limit(), std::nullopt);
}

TEST_F(PlayerStepGate, holdsNothingWhereTheRobotsTimeIsTheReplays) {
  options.has_recorded_time = true;
  goals.add(kArm.topic, goal("a", 0, 2000));
  EXPECT_FALSE(gate.moveLimit(std::nullopt).has_moved);
}

// ------------------------------------------------------------------------------------- the outbox

struct PlayerOutbox : PlayerParts {
  PlayerOutbox() {
    plays(kCmdVel, Modality::Body);
    plays(kArm, Modality::Body);
    plays(kCloud, Modality::Ar);
    begin();
    const auto ros_now = [this] { return Stamp{clock.now().ns + 2 * kBegin}; };
    outbox = std::make_unique<Outbox>(play, lead, sink, ros_now,
                                      [] { return std::string("fresh"); });
  }
  Outbox::Outgoing due(const Channel& channel, Bytes bytes, std::int64_t late_ms = 0) {
    return {outbox->topic(channel.topic), channel,           recordedAt(0), recordedAt(0),
            std::move(bytes),             late_ms * kMs};
  }
  std::unique_ptr<Outbox> outbox;
};

TEST_F(PlayerOutbox, makesAGoalOfThisReplayAndCountsIt) {
  const auto sent = outbox->publish(due(kArm, goalMessage("recorded", {1})));
  ASSERT_TRUE(sent && sent->goal);
  EXPECT_EQ(*sent->goal, "fresh");
  EXPECT_TRUE(sent->was_heard);
  EXPECT_EQ(goalId(sink.on(kArm.topic).at(0).bytes), "fresh");
  EXPECT_EQ(ledger.topic(kArm.topic).published, 1u);
  EXPECT_EQ(outbox->published(), 1u);
}

TEST_F(PlayerOutbox, leavesOutOldVelocitiesButNoZeroOnes) {
  EXPECT_FALSE(outbox->leavesOut(due(kCmdVel, twist(0.5), 200)));
  EXPECT_TRUE(outbox->leavesOut(due(kCmdVel, twist(0.5), 300)));
  EXPECT_FALSE(outbox->leavesOut(due(kCmdVel, twist(0), 3000)));
  EXPECT_EQ(ledger.topic(kCmdVel.topic).skipped, 1u);
  EXPECT_THROW(outbox->leavesOut(due(kArm, goalMessage("recorded", {1}), 1001)),
               std::runtime_error);
}

TEST_F(PlayerOutbox, refusesVelocitiesThatAreNoNumbers) {
  EXPECT_FALSE(outbox->publish(due(kCmdVel, twist(std::nan("")))));
  EXPECT_TRUE(sink.sent.empty());
  EXPECT_EQ(ledger.topic(kCmdVel.topic).refused, 1u);
  EXPECT_EQ(ledger.topic(kCmdVel.topic).problem, "linear.x is nan");
}

TEST_F(PlayerOutbox, endsWhatItMovedAndLitAndNothingElse) {
  outbox->sendZeroVelocities();
  outbox->clearProjection();
  EXPECT_TRUE(sink.sent.empty());
  outbox->publish(due(kCmdVel, twist(0.5)));
  outbox->publish(due(kCloud, cloud(3)));
  EXPECT_TRUE(outbox->isLit());
  outbox->sendZeroVelocities();
  outbox->clearProjection();
  EXPECT_EQ(sink.on(kCmdVel.topic).back().bytes, twist(0));
  EXPECT_EQ(cloudWidth(sink.on(kCloud.topic).back().bytes), 0u);
  EXPECT_FALSE(outbox->isLit());
}

// --------------------------------------------------------------------------- what the body is told

struct PlayerBody : PlayerOutbox {
  void tell(const Channel& channel, Bytes bytes, std::int64_t at_ms) {
    body.send({outbox->topic(channel.topic), channel, recordedAt(at_ms), recordedAt(at_ms),
               std::move(bytes)});
  }
  BodyInForce body{play, milestones, goals, *outbox, lead, gate};
};

TEST_F(PlayerBody, isSuspendedAndToldAgainWhatIsLeft) {
  tell(kArm, goalMessage("recorded", {1, 4}), 0);
  tell(kCmdVel, twist(0.5), 0);
  ASSERT_TRUE(goals.hasOpen());
  clock.sleepUntil(after(100));
  transport.change([&](Timeline& timeline) { timeline.pause(clock.now()); });
  sink.sent.clear();
  body.suspend(clock.now());
  ASSERT_EQ(sink.sent.size(), 2u);
  EXPECT_EQ(sink.sent[0].bytes, twist(0));
  EXPECT_EQ(sink.sent[1].bytes, cancelMessage("fresh"));
  EXPECT_FALSE(goals.isOpen(kArm.topic));
  clock.sleepUntil(after(9000));
  transport.change([&](Timeline& timeline) { timeline.resume(clock.now()); });
  sink.sent.clear();
  body.proceed();
  ASSERT_EQ(sink.on(kArm.topic).size(), 1u);
  EXPECT_EQ(timesFromStart(sink.on(kArm.topic)[0].bytes), (std::vector<double>{0.9, 3.9}));
  EXPECT_EQ(sink.on(kCmdVel.topic).at(0).bytes, twist(0.5)) << "100 ms old: it still holds";
  EXPECT_EQ(goals.counts().sent, 1u) << "the same goal";
}

TEST_F(PlayerBody, failsWithAGoalThatDidNotFailWhenItWasRecorded) {
  tell(kArm, goalMessage("recorded", {1}), 0);
  goals.finish("fresh", GoalOutcome::Failed, clock.now(), GoalEnd(5).words());
  EXPECT_FALSE(body.followEnds());
  EXPECT_EQ(transport.stopReason(),
            "body failed: a goal on /arm/follow_joint_trajectory/goal was rejected");
  EXPECT_EQ(ledger.report().goal_spans.at(0).outcome, GoalOutcome::Failed);
}

TEST_F(PlayerBody, hasItsGoalsCanceledWhenTheyAreGivenUp) {
  tell(kArm, goalMessage("recorded", {1}), 0);
  body.giveUpGoals();
  EXPECT_EQ(sink.sent.back().topic, "/arm/follow_joint_trajectory/cancel");
  EXPECT_FALSE(goals.isOpen(kArm.topic));
  EXPECT_EQ(goals.counts().canceled, 1u);
}

}  // namespace
}  // namespace afterglow::replay::player_parts_test
