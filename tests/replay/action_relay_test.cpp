// A server in ROS 2 as actionlib's, without either of them.
#include "replay/ros2/action_relay.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "replay/messages/document.hpp"
#include "tests/support/cdr_bytes.hpp"
#include "tests/support/message_corpus.hpp"

namespace afterglow::replay::action_relay_test {
namespace {

constexpr Stamp kNow{5'000'000'000};
constexpr std::array<std::uint8_t, 16> kOurWriter{1}, kOtherWriter{2};
constexpr GoalUuid kFirst{0xf0}, kOther{0xaa};
const std::string kFirstId = goalIdOf(kFirst), kOtherId = goalIdOf(kOther);

ActionType fibonacci() {
  return {"test_msgs/Fibonacci",
          {"int32 order\n", "int32[] sequence\n", "int32[] sequence\n"},
          [](const std::string&) { return std::nullopt; }};
}

/// A bridge between a client of ROS 1 and a server of ROS 2 that are played by the test.
class ActionRelayTest : public testing::Test {
 protected:
  struct Sent {
    ActionService service;
    RequestId id;
    Bytes cdr;
  };

  ActionRelay::Outlets outlets() {
    ActionRelay::Outlets outlets;
    outlets.request = [this](ActionService service, const Bytes& cdr) {
      sent_.push_back({service, {kOurWriter, static_cast<std::int64_t>(sent_.size())}, cdr});
      return sent_.back().id;
    };
    outlets.publish = [this](ActionTopic topic, const Bytes& bytes) { note(topic, bytes); };
    outlets.tell = [this](const std::string& problem) { problems_.push_back(problem); };
    outlets.fresh_uuid = [] { return kFirst; };
    return outlets;
  }

  /// Notes "goal ID order", "result ID state sequence: text", ...; `status_` gets the last status.
  void note(ActionTopic topic, const Bytes& bytes) {
    const ActionType type = fibonacci();
    if (topic == ActionTopic::Cancel) {
      const ActionGoalId id = readGoalId(bytes);
      return heard_.push_back("cancel " + id.id + " " + std::to_string(id.stamp.ns));
    }
    if (topic == ActionTopic::Status) {
      status_.clear();
      const std::string definition =
          "Header header\nGoalStatus[] status_list\n===\nMSG: actionlib_msgs/GoalStatus\n"
          "GoalID goal_id\nuint8 status\nstring text\n===\nMSG: actionlib_msgs/GoalID\n"
          "time stamp\nstring id\n";
      const auto json =
          toJson(decode(Schema::parse("actionlib_msgs/GoalStatusArray", definition), bytes));
      for (const auto& goal : json["status_list"]) {
        status_ += goal["goal_id"]["id"].get<std::string>() + "=" + goal["status"].dump() + " ";
      }
      return;
    }
    const Channel& channel = topic == ActionTopic::Goal     ? type.goal()
                             : topic == ActionTopic::Result ? type.result()
                                                            : type.feedback();
    const auto json = toJson(decode(Schema::parse(channel.type, channel.definition), bytes));
    if (topic == ActionTopic::Goal) {
      return heard_.push_back("goal " + json["goal_id"]["id"].get<std::string>() + " " +
                              json["goal"]["order"].dump());
    }
    const bool is_result = topic == ActionTopic::Result;
    heard_.push_back((is_result ? "result " : "feedback ") +
                     json["status"]["goal_id"]["id"].get<std::string>() + " " +
                     json["status"]["status"].dump() + " " +
                     json[is_result ? "result" : "feedback"]["sequence"].dump() + " " +
                     json["status"]["text"].get<std::string>());
  }

  void sendGoal(const std::string& id, Stamp stamp = {}) {
    relay_.onRos1Goal(actionGoalMessage(kNow, {{stamp, id}, {7, 0, 0, 0}}), kNow);
  }
  void cancel(const std::string& id, Stamp stamp = {}) {
    relay_.onRos1Cancel(goalIdMessage({stamp, id}));
  }
  void foreignGoal(std::int64_t number = 0) {
    relay_.onRequest(ActionService::SendGoal, {kOtherWriter, number},
                     fibonacci().goalRequest(kOther, {7, 0, 0, 0}), kNow);
  }
  void answer(const RequestId& id, bool is_accepted) {
    test::CdrBytes cdr;
    cdr.put<std::uint8_t>(is_accepted).put<std::int32_t>(0).put<std::uint32_t>(0);
    relay_.onReply(ActionService::SendGoal, id, cdr, kNow);
  }
  void result(const RequestId& id, std::int8_t status) {
    test::CdrBytes cdr;
    cdr.put(status).put<std::uint32_t>(2).put<std::int32_t>(0).put<std::int32_t>(1);
    relay_.onReply(ActionService::GetResult, id, cdr, kNow);
  }
  void feedback(const GoalUuid& uuid) {
    test::CdrBytes cdr;
    for (const std::uint8_t byte : uuid) cdr.put(byte);
    relay_.onFeedback(cdr.put<std::uint32_t>(1).put<std::int32_t>(4), kNow);
  }
  void status(const GoalUuid& uuid, std::int8_t status) {
    test::CdrBytes cdr;
    cdr.put<std::uint32_t>(1);
    for (const std::uint8_t byte : uuid) cdr.put(byte);
    relay_.onStatus(cdr.put<std::int32_t>(3).put<std::uint32_t>(0).put(status), kNow);
  }
  void tick(int times) {
    for (; times > 0; --times) relay_.tick(kNow);
  }
  std::size_t requests(ActionService service) const {
    return static_cast<std::size_t>(std::count_if(
        sent_.begin(), sent_.end(), [&](const Sent& sent) { return sent.service == service; }));
  }
  /// The last request.
  const Sent& last() const { return sent_.back(); }

  std::vector<Sent> sent_;
  std::vector<std::string> heard_, problems_;
  std::string status_;
  ActionRelay relay_{fibonacci(), outlets()};
};
using Heard = std::vector<std::string>;

TEST_F(ActionRelayTest, takesAGoalOfRos1ToItsResult) {
  sendGoal("/client-1");
  EXPECT_EQ(status_, "/client-1=0 ");
  ASSERT_EQ(last().service, ActionService::SendGoal);
  EXPECT_EQ(last().cdr, fibonacci().goalRequest(kFirst, {7, 0, 0, 0}));
  answer(last().id, true);
  ASSERT_EQ(last().service, ActionService::GetResult);
  EXPECT_EQ(last().cdr, resultRequest(kFirst));
  status(kFirst, 2);
  EXPECT_EQ(status_, "/client-1=1 ");
  feedback(kFirst);
  status(kFirst, 4);
  EXPECT_EQ(status_, "/client-1=1 ");  // the result says more
  result(last().id, 4);
  EXPECT_EQ(heard_, (Heard{"feedback /client-1 1 [4] ", "result /client-1 3 [0,1] "}));
  EXPECT_EQ(status_, "/client-1=3 ");
  tick(25);
  EXPECT_EQ(status_, "/client-1=3 ");
  tick(1);
  EXPECT_EQ(status_, "");
  EXPECT_TRUE(problems_.empty());
}

TEST_F(ActionRelayTest, givesAGoalWithoutIdOne) {
  sendGoal("");
  EXPECT_EQ(status_, kFirstId + "=0 ");
}

TEST_F(ActionRelayTest, keepsAnIdThatIsAUuid) {
  sendGoal(kOtherId);
  EXPECT_EQ(last().cdr, fibonacci().goalRequest(kOther, {7, 0, 0, 0}));
}

TEST_F(ActionRelayTest, ignoresAGoalThatItKnows) {
  sendGoal("a");
  sendGoal("a");
  EXPECT_EQ(sent_.size(), 1u);
}

TEST_F(ActionRelayTest, tellsARejection) {
  sendGoal("a");
  answer(last().id, false);
  EXPECT_EQ(heard_, Heard{"result a 5 [] the server rejected the goal"});
  EXPECT_EQ(requests(ActionService::GetResult), 0u);
}

TEST_F(ActionRelayTest, rejectsAGoalThatRos2CannotHave) {
  relay_.onRos1Goal(actionGoalMessage(kNow, {{{}, "a"}, {7, 0}}), kNow);
  ASSERT_EQ(heard_.size(), 1u);
  EXPECT_EQ(heard_[0],
            "result a 5 [] test_msgs/Fibonacci_SendGoal_Request, at byte 0: holds 18 bytes; no "
            "message of this type has fewer than 20");
  EXPECT_TRUE(sent_.empty());
}

TEST_F(ActionRelayTest, cancelsAGoalByItsId) {
  sendGoal("a");
  answer(last().id, true);
  const RequestId asked = last().id;
  cancel("b");
  EXPECT_EQ(requests(ActionService::CancelGoal), 0u);
  cancel("a");
  ASSERT_EQ(last().service, ActionService::CancelGoal);
  EXPECT_EQ(last().cdr, cancelRequest(kFirst));
  status(kFirst, 3);
  EXPECT_EQ(status_, "a=6 ");
  result(asked, 5);
  EXPECT_EQ(heard_, Heard{"result a 2 [0,1] "});
}

TEST_F(ActionRelayTest, cancelsAGoalOnceItIsAccepted) {
  sendGoal("a");
  cancel("a");
  EXPECT_EQ(requests(ActionService::CancelGoal), 0u);
  answer(last().id, true);
  EXPECT_EQ(requests(ActionService::CancelGoal), 1u);
}

TEST_F(ActionRelayTest, cancelsAllOfTheServersGoals) {
  cancel("");
  ASSERT_EQ(requests(ActionService::CancelGoal), 1u);
  EXPECT_EQ(last().cdr, cancelRequest(kNoGoal));
}

TEST_F(ActionRelayTest, cancelsGoalsUpToAStamp) {
  sendGoal("a", {10});
  answer(last().id, true);
  cancel("", {9});
  EXPECT_EQ(requests(ActionService::CancelGoal), 0u);
  cancel("", {10});
  EXPECT_EQ(last().cdr, cancelRequest(kFirst));
  sendGoal("late", {10});
  EXPECT_EQ(heard_, Heard{"result late 8 [] a cancel came before it"});
}

TEST_F(ActionRelayTest, doesNotSendAGoalWhoseCancelCameFirst) {
  cancel("a");
  sendGoal("a");
  EXPECT_EQ(heard_, Heard{"result a 8 [] a cancel came before it"});
  EXPECT_TRUE(sent_.empty());
  tick(26);
  sendGoal("a");
  EXPECT_EQ(requests(ActionService::SendGoal), 1u);
}

TEST_F(ActionRelayTest, tellsARefusedCancel) {
  sendGoal("a");
  answer(last().id, true);
  cancel("a");
  relay_.onReply(ActionService::CancelGoal, last().id,
                 test::CdrBytes().put<std::int8_t>(1).put<std::uint32_t>(0), kNow);
  EXPECT_EQ(problems_, Heard{"the server refuses to cancel a goal"});
}

TEST_F(ActionRelayTest, showsOtherClientsGoalsWithTheirResults) {
  foreignGoal();
  answer({kOtherWriter, 0}, true);
  ASSERT_EQ(last().service, ActionService::GetResult);
  status(kOther, 2);
  EXPECT_EQ(status_, kOtherId + "=1 ");
  feedback(kOther);
  result(last().id, 6);
  EXPECT_EQ(heard_, (Heard{"goal " + kOtherId + " 7", "feedback " + kOtherId + " 1 [4] ",
                           "result " + kOtherId + " 4 [0,1] "}));
}

TEST_F(ActionRelayTest, showsOtherClientsRejectionsAndCancels) {
  foreignGoal();
  answer({kOtherWriter, 0}, false);
  relay_.onRequest(ActionService::CancelGoal, {kOtherWriter, 0}, cancelRequest(kOther), kNow);
  relay_.onRequest(ActionService::CancelGoal, {kOtherWriter, 1}, cancelRequest(kNoGoal), kNow);
  EXPECT_EQ(heard_, (Heard{"goal " + kOtherId + " 7",
                           "result " + kOtherId + " 5 [] the server rejected the goal",
                           "cancel " + kOtherId + " 0", "cancel  0"}));
}

TEST_F(ActionRelayTest, showsARejectionThatIsReadBeforeItsGoal) {
  answer({kOtherWriter, 0}, false);
  foreignGoal();
  EXPECT_EQ(heard_, (Heard{"goal " + kOtherId + " 7",
                           "result " + kOtherId + " 5 [] the server rejected the goal"}));
}

TEST_F(ActionRelayTest, doesNotShowItsOwnRequestsAsOthers) {
  sendGoal("a");
  const Sent goal = last();
  relay_.onRequest(ActionService::SendGoal, goal.id, goal.cdr, kNow);
  answer(goal.id, true);
  cancel("a");
  relay_.onRequest(ActionService::CancelGoal, last().id, last().cdr, kNow);
  EXPECT_EQ(heard_, Heard{});
}

TEST_F(ActionRelayTest, cancelsOtherClientsGoalsForRos1) {
  foreignGoal();
  answer({kOtherWriter, 0}, true);
  cancel(kOtherId);
  EXPECT_EQ(last().cdr, cancelRequest(kOther));
}

TEST_F(ActionRelayTest, showsAGoalWhoseStatusCameFirst) {
  status(kOther, 1);
  EXPECT_EQ(requests(ActionService::GetResult), 1u);
  foreignGoal();
  answer({kOtherWriter, 0}, true);
  EXPECT_EQ(heard_, Heard{"goal " + kOtherId + " 7"});
  EXPECT_EQ(requests(ActionService::GetResult), 1u);
}

TEST_F(ActionRelayTest, passesOverGoalsThatEndedBeforeIt) {
  status(kOther, 4);
  EXPECT_EQ(status_, "");
  EXPECT_TRUE(sent_.empty());
}

TEST_F(ActionRelayTest, endsGoalsWhoseServerIsSilentOrGone) {
  sendGoal("a");
  tick(151);
  EXPECT_EQ(heard_, Heard{"result a 4 [] the server did not answer"});
  sendGoal(kOtherId);
  answer(last().id, true);
  status(kOther, 4);
  tick(26);
  EXPECT_EQ(heard_.back(), "result " + kOtherId + " 3 [] the server gave no result");
  sendGoal("b");
  relay_.onServerGone(kNow);
  EXPECT_EQ(heard_.back(), "result b 4 [] the action's server is gone");
}

TEST_F(ActionRelayTest, cancelsRos1sGoalsAtItsEnd) {
  foreignGoal();
  answer({kOtherWriter, 0}, true);
  sendGoal("a");
  relay_.onBridgeEnds(kNow);
  EXPECT_EQ(last().cdr, cancelRequest(kFirst));
  EXPECT_EQ(requests(ActionService::CancelGoal), 1u);
  EXPECT_EQ(heard_.back(), "result a 4 [] the bridge to ROS 2 ends");
}

TEST_F(ActionRelayTest, tellsBytesThatAreNoMessages) {
  const Bytes junk(30, 0xff);
  relay_.onRos1Goal(junk, kNow);
  relay_.onRos1Cancel(junk);
  relay_.onRequest(ActionService::SendGoal, {kOtherWriter, 0}, junk, kNow);
  relay_.onRequest(ActionService::CancelGoal, {kOtherWriter, 0}, junk, kNow);
  relay_.onFeedback(junk, kNow);
  relay_.onStatus(junk, kNow);
  foreignGoal();
  relay_.onReply(ActionService::SendGoal, {kOtherWriter, 0}, junk, kNow);
  ASSERT_EQ(problems_.size(), 7u);
  EXPECT_EQ(problems_[4],
            "feedback: test_msgs/Fibonacci_FeedbackMessage, at byte 0: is not serialized as ROS "
            "2's nodes do (CDR, version 1)");
}

}  // namespace
}  // namespace afterglow::replay::action_relay_test
