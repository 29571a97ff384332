// A server in ROS 1 as one of ROS 2, without either of them.
#include "replay/ros2/action_relay_to_ros2.hpp"

#include <gtest/gtest.h>

#include "tests/support/cdr_bytes.hpp"

namespace afterglow::replay::action_relay_to_ros2_test {
namespace {

constexpr Stamp kNow{5'000'000'000};
constexpr GoalUuid kFirst{0xf0}, kFresh{0xaa};
const std::string kFirstId = goalIdOf(kFirst);
constexpr RequestId kGoal{{1}, 1}, kResult{{1}, 2}, kCancel{{1}, 3};
const Bytes kSequence{1, 0, 0, 0, 4, 0, 0, 0};

ActionType fibonacci() {
  return {"test_msgs/Fibonacci",
          {"int32 order\n", "int32[] sequence\n", "int32[] sequence\n"},
          [](const std::string&) { return std::nullopt; }};
}

std::string textOf(const std::vector<Ros2GoalStatus>& list) {
  std::string text;
  for (const Ros2GoalStatus& one : list) {
    text += goalIdOf(one.goal.uuid).substr(0, 2) + "=" + std::to_string(one.status) + " ";
  }
  return text;
}

/// A bridge between a client of ROS 2 and a server of ROS 1 that are played by the test.
class ActionRelayToRos2Test : public testing::Test {
 protected:
  ActionRelayToRos2::Outlets outlets() {
    ActionRelayToRos2::Outlets outlets;
    outlets.reply = [this](ActionService service, const RequestId& id, const Bytes& cdr) {
      heard_.push_back(std::to_string(id.number) + ": " + textOf(service, cdr));
    };
    outlets.publish_on_ros2 = [this](ActionTopic topic, const Bytes& cdr) {
      if (topic == ActionTopic::Status) {
        status_ = action_relay_to_ros2_test::textOf(readStatusList(cdr));
      } else {
        heard_.push_back("feedback " + goalIdOf(fibonacci().readFeedback(cdr).first).substr(0, 2));
      }
    };
    outlets.publish_on_ros1 = [this](ActionTopic topic, const Bytes& bytes) {
      const bool is_goal = topic == ActionTopic::Goal;
      const ActionGoalId id = is_goal ? readActionGoal(bytes).id : readGoalId(bytes);
      heard_.push_back((is_goal ? "goal " : "cancel ") + id.id + " " + std::to_string(id.stamp.ns));
    };
    outlets.tell = [this](const std::string& problem) { problems_.push_back(problem); };
    outlets.fresh_uuid = [] { return kFresh; };
    return outlets;
  }

  std::string textOf(ActionService service, const Bytes& cdr) const {
    if (service == ActionService::SendGoal) return readIsAccepted(cdr) ? "accepted" : "rejected";
    if (service == ActionService::CancelGoal) {
      return "cancel " + std::to_string(static_cast<int>(readCancelReply(cdr)));
    }
    const auto [status, result] = fibonacci().readResultReply(cdr);
    return "result " + std::to_string(status) + (result == kSequence ? " [4]" : " []");
  }

  void sendGoal(const GoalUuid& uuid = kFirst) {
    relay_.onRequest(ActionService::SendGoal, kGoal, fibonacci().goalRequest(uuid, {7, 0, 0, 0}),
                     kNow);
  }
  void askForResult(const GoalUuid& uuid = kFirst) {
    relay_.onRequest(ActionService::GetResult, kResult, resultRequest(uuid), kNow);
  }
  void cancel(const GoalUuid& uuid = kFirst) {
    relay_.onRequest(ActionService::CancelGoal, kCancel, cancelRequest(uuid), kNow);
  }
  using Listed = std::vector<std::pair<std::string, GoalState>>;
  void status(const Listed& goals) {
    std::vector<ActionGoalStatus> list;
    for (const auto& [id, state] : goals) list.push_back({{{3}, id}, state, ""});
    relay_.onStatus(statusListMessage(kNow, list), kNow);
  }
  void status(GoalState state) { status({{kFirstId, state}}); }
  void result(GoalState state, const Bytes& part = kSequence) {
    relay_.onResult(actionUpdateMessage(kNow, {{{3}, kFirstId}, state, ""}, part), kNow);
  }
  void tick(int times) {
    for (; times > 0; --times) relay_.tick(kNow);
  }
  /// What was heard since the last call.
  std::vector<std::string> heard() { return std::exchange(heard_, {}); }
  /// A goal that the server has begun.
  void beginGoal() {
    sendGoal();
    status(GoalState::Active);
    heard();
  }

  std::vector<std::string> heard_, problems_;
  std::string status_;
  ActionRelayToRos2 relay_{fibonacci(), outlets()};
};
using Heard = std::vector<std::string>;

TEST_F(ActionRelayToRos2Test, takesAGoalOfRos2ToItsResult) {
  sendGoal();
  EXPECT_EQ(heard(), Heard{"goal " + kFirstId + " 5000000000"});
  status(Listed{});
  EXPECT_EQ(status_, "");
  status(GoalState::Active);
  EXPECT_EQ(heard(), Heard{"1: accepted"});
  EXPECT_EQ(status_, "f0=2 ");
  askForResult();
  relay_.onFeedback(actionUpdateMessage(kNow, {{{3}, kFirstId}, GoalState::Active, ""}, kSequence));
  status(GoalState::Succeeded);
  EXPECT_EQ(status_, "f0=2 ");  // the result says more
  EXPECT_TRUE(relay_.isBusy());
  result(GoalState::Succeeded);
  EXPECT_EQ(heard(), (Heard{"feedback f0", "2: result 4 [4]"}));
  EXPECT_EQ(status_, "f0=4 ");
  EXPECT_FALSE(relay_.isBusy());
  tick(50);
  askForResult();
  tick(1);
  askForResult();
  EXPECT_EQ(heard(), (Heard{"2: result 4 [4]", "2: result 0 []"}));
  EXPECT_EQ(status_, "");
  EXPECT_TRUE(problems_.empty());
}

TEST_F(ActionRelayToRos2Test, acceptsAGoalThatEndsBeforeItsStatusIsTold) {
  sendGoal();
  result(GoalState::Aborted);
  askForResult();
  EXPECT_EQ(heard(), (Heard{"goal " + kFirstId + " 5000000000", "1: accepted", "2: result 6 [4]"}));
}

TEST_F(ActionRelayToRos2Test, tellsARejectionUnlessItComesTooLate) {
  sendGoal();
  status(GoalState::Pending);
  EXPECT_EQ(heard().size(), 1u);
  status(GoalState::Rejected);
  result(GoalState::Rejected);
  EXPECT_EQ(heard(), Heard{"1: rejected"});
  EXPECT_EQ(status_, "");
}

TEST_F(ActionRelayToRos2Test, acceptsAGoalThatTheServerKeepsWaiting) {
  sendGoal();
  status(GoalState::Pending);
  tick(5);
  EXPECT_EQ(heard().size(), 1u);
  tick(1);
  EXPECT_EQ(heard(), Heard{"1: accepted"});
  EXPECT_EQ(status_, "f0=1 ");
  askForResult();
  result(GoalState::Rejected);
  EXPECT_EQ(heard(), Heard{"2: result 6 [4]"});
  EXPECT_EQ(status_, "f0=6 ");
}

TEST_F(ActionRelayToRos2Test, rejectsAGoalThatTheServerDoesNotAnswerAndCancelsIt) {
  sendGoal();
  heard();
  tick(150);
  EXPECT_EQ(heard(), Heard{});
  tick(1);
  EXPECT_EQ(heard(), (Heard{"cancel " + kFirstId + " 0", "1: rejected"}));
  EXPECT_EQ(problems_, Heard{"the server in ROS 1 did not answer"});
}

TEST_F(ActionRelayToRos2Test, rejectsAGoalWhoseIdIsTaken) {
  beginGoal();
  sendGoal();
  sendGoal(kNoGoal);
  EXPECT_EQ(heard(), (Heard{"1: rejected", "1: rejected"}));
}

TEST_F(ActionRelayToRos2Test, answersACancelOnceTheServerHeedsIt) {
  beginGoal();
  cancel();
  EXPECT_EQ(heard(), Heard{"cancel " + kFirstId + " 0"});
  status(GoalState::Preempting);
  EXPECT_EQ(heard(), Heard{"3: cancel 0"});
  EXPECT_EQ(status_, "f0=3 ");
  askForResult();
  result(GoalState::Preempted);
  EXPECT_EQ(heard(), Heard{"2: result 5 [4]"});
}

TEST_F(ActionRelayToRos2Test, tellsWhyNothingIsCanceled) {
  cancel();
  EXPECT_EQ(heard(), (Heard{"cancel " + kFirstId + " 0", "3: cancel 2"}));  // not known here
  beginGoal();
  cancel();
  tick(6);
  EXPECT_EQ(heard(), (Heard{"cancel " + kFirstId + " 0", "3: cancel 1"}));  // not heeded
  cancel();
  result(GoalState::Succeeded);
  cancel();
  EXPECT_EQ(heard(), (Heard{"cancel " + kFirstId + " 0", "3: cancel 3",  // too late
                            "cancel " + kFirstId + " 0", "3: cancel 3"}));
}

TEST_F(ActionRelayToRos2Test, cancelsAllGoalsEvenThoseItDoesNotKnow) {
  cancel(kNoGoal);
  EXPECT_EQ(heard(), (Heard{"cancel  0", "3: cancel 0"}));
  status({{"/client-1", GoalState::Active}, {kFirstId, GoalState::Pending}});
  cancel(kNoGoal);
  status({{"/client-1", GoalState::Preempting}, {kFirstId, GoalState::Pending}});
  EXPECT_EQ(heard(), Heard{"cancel  0"});
  status({{"/client-1", GoalState::Preempting}, {kFirstId, GoalState::Recalling}});
  EXPECT_EQ(heard(), Heard{"3: cancel 0"});
}

TEST_F(ActionRelayToRos2Test, showsGoalsOfRos1sClients) {
  status({{"/client-1", GoalState::Active}, {"/client-2", GoalState::Succeeded}});
  EXPECT_EQ(status_, "aa=2 ");
  EXPECT_FALSE(relay_.isBusy());
  askForResult(kFresh);
  relay_.onResult(
      actionUpdateMessage(kNow, {{{3}, "/client-1"}, GoalState::Succeeded, ""}, kSequence), kNow);
  EXPECT_EQ(heard(), Heard{"2: result 4 [4]"});
}

TEST_F(ActionRelayToRos2Test, endsGoalsWhoseServerIsGoneOrBeginsAnew) {
  beginGoal();
  askForResult();
  status(Listed{});
  EXPECT_EQ(heard(), Heard{"2: result 6 []"});
  sendGoal(kFresh);
  relay_.onServerGone(kNow);
  EXPECT_EQ(heard(), (Heard{"goal " + goalIdOf(kFresh) + " 5000000000", "1: rejected"}));
  EXPECT_EQ(problems_, Heard{"the action's server in ROS 1 is gone"});
  relay_.onServerGone(kNow);
  EXPECT_EQ(problems_.size(), 1u);
}

TEST_F(ActionRelayToRos2Test, endsAGoalWhoseResultNeverComes) {
  beginGoal();
  askForResult();
  status(GoalState::Succeeded);
  tick(25);
  EXPECT_EQ(heard(), Heard{});
  tick(1);
  EXPECT_EQ(heard(), Heard{"2: result 4 []"});
}

TEST_F(ActionRelayToRos2Test, cancelsRos2sGoalsAtItsEnd) {
  beginGoal();
  status({{kFirstId, GoalState::Active}, {"/client-1", GoalState::Active}});
  askForResult();
  relay_.onBridgeEnds(kNow);
  EXPECT_EQ(heard(), (Heard{"cancel " + kFirstId + " 0", "2: result 6 []"}));
}

TEST_F(ActionRelayToRos2Test, seesWhetherTheServerIsThere) {
  EXPECT_FALSE(relay_.isServerAlive());
  status(Listed{});
  tick(25);
  EXPECT_TRUE(relay_.isServerAlive());
  tick(1);
  EXPECT_FALSE(relay_.isServerAlive());
}

TEST_F(ActionRelayToRos2Test, tellsBytesThatAreNoMessages) {
  const Bytes junk(30, 0xff);
  relay_.onRequest(ActionService::SendGoal, kGoal, junk, kNow);
  relay_.onRequest(ActionService::GetResult, kResult, junk, kNow);
  relay_.onRequest(ActionService::CancelGoal, kCancel, junk, kNow);
  EXPECT_EQ(heard(), Heard{"1: rejected"});
  relay_.onStatus(junk, kNow);
  relay_.onFeedback(junk);
  relay_.onResult(junk, kNow);
  EXPECT_EQ(problems_.size(), 6u);
  beginGoal();
  askForResult();
  result(GoalState::Succeeded, {1, 2});  // the robot is done, whatever it tells
  EXPECT_EQ(heard(), Heard{"2: result 4 []"});
  ASSERT_EQ(problems_.size(), 7u);
}

}  // namespace
}  // namespace afterglow::replay::action_relay_to_ros2_test
