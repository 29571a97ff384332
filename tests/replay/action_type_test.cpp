// An action's messages of ROS 2 as those of actionlib, and its types.
#include "replay/ros2/action_type.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "replay/messages/document.hpp"
#include "tests/support/cdr_bytes.hpp"
#include "tests/support/message_corpus.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::action_type_test {
namespace {

namespace fs = std::filesystem;
using test::messageErrorOf;

const FindDefinition kNothingKnown = [](const std::string&) { return std::nullopt; };
constexpr GoalUuid kUuid = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
const std::string kUuidHex = "0102030405060708090a0b0c0d0e0f10";

std::string jsonOf(const Channel& channel, const Bytes& bytes) {
  return toJson(decode(Schema::parse(channel.type, channel.definition), bytes)).dump();
}

/// Definitions as ROS 2's packages install them.
class ActionTypeTest : public testing::Test {
 protected:
  void write(const std::string& path, const std::string& text) const {
    fs::create_directories(fs::path(folder_.path(path)).parent_path());
    test::writeFile(folder_.path(path), text);
  }
  std::optional<ActionText> find(const std::string& type,
                                 const FindDefinition& ros1 = kNothingKnown) const {
    return ros2Action(type, DefinitionFolders({folder_.path("share")}), ros1);
  }
  ActionType fibonacci() const {
    write("share/test_msgs/action/Fibonacci.action",
          "#goal definition\nint32 order\n---\n#result definition\nint32[] sequence\n---\n"
          "#feedback\nint32[] sequence\n");
    return {"test_msgs/Fibonacci", *find("test_msgs/Fibonacci"), kNothingKnown};
  }

  test::TempFolder folder_;
};

TEST_F(ActionTypeTest, readsAndWritesWhatRclpySerializes) {
  // serialize_message() of Kilted (rmw_fastrtps_cpp), 2026.
  const ActionType type = fibonacci();
  const Bytes request = test::bytesFromHex("00010000" + kUuidHex + "07000000");
  const auto [uuid, goal] = type.readGoalRequest(request);
  EXPECT_EQ(uuid, kUuid);
  EXPECT_EQ(goal, (Bytes{7, 0, 0, 0}));
  EXPECT_EQ(type.goalRequest(uuid, goal), request);
  EXPECT_EQ(jsonOf(type.goal(), actionGoalMessage({1'000'000'002}, {{{3}, "x"}, goal})),
            R"({"goal":{"order":7},"goal_id":{"id":"x","stamp":{"nsecs":3,"secs":0}},)"
            R"("header":{"frame_id":"","seq":0,"stamp":{"nsecs":2,"secs":1}}})");

  const Bytes reply = test::bytesFromHex("000100000400000003000000000000000100000001000000");
  const auto [status, result] = type.readResultReply(reply);
  EXPECT_EQ(status, 4);
  EXPECT_EQ(type.resultReply(status, result), reply);
  const ActionGoalStatus succeeded{{{3}, "x"}, GoalState::Succeeded, "done"};
  EXPECT_EQ(jsonOf(type.result(), actionUpdateMessage({4}, succeeded, result)),
            R"({"header":{"frame_id":"","seq":0,"stamp":{"nsecs":4,"secs":0}},)"
            R"("result":{"sequence":[0,1,1]},"status":{"goal_id":{"id":"x",)"
            R"("stamp":{"nsecs":3,"secs":0}},"status":3,"text":"done"}})");

  const Bytes message = test::bytesFromHex("00010000" + kUuidHex + "020000000000000001000000");
  const auto [of, feedback] = type.readFeedback(message);
  EXPECT_EQ(of, kUuid);
  EXPECT_EQ(type.feedbackMessage(of, feedback), message);
  EXPECT_NE(jsonOf(type.feedback(), actionUpdateMessage({4}, succeeded, feedback))
                .find(R"("feedback":{"sequence":[0,1]})"),
            std::string::npos);
  EXPECT_EQ(type.noResult(), Bytes(4));
}

TEST(ActionMessages, areWhatRclpySerializes) {
  const Bytes accepted = test::bytesFromHex("00010000010000000500000006000000");
  EXPECT_TRUE(readIsAccepted(accepted));
  EXPECT_EQ(goalReply(true, Stamp::fromParts(5, 6)), accepted);
  EXPECT_FALSE(readIsAccepted(test::bytesFromHex("00010000000000000000000000000000")));
  EXPECT_EQ(resultRequest(kUuid), test::bytesFromHex("00010000" + kUuidHex));
  EXPECT_EQ(readResultRequest(resultRequest(kUuid)), kUuid);
  EXPECT_EQ(cancelRequest(kUuid), test::bytesFromHex("00010000" + kUuidHex + "0000000000000000"));
  const std::string info = kUuidHex + "0500000006000000";
  const GoalInfo cancel = readCancelRequest(test::bytesFromHex("00010000" + info));
  EXPECT_EQ(cancel.uuid, kUuid);
  EXPECT_EQ(cancel.stamp, Stamp::fromParts(5, 6));
  const Bytes canceling = test::bytesFromHex("000100000000000001000000" + info);
  EXPECT_EQ(readCancelReply(canceling), CancelCode::Canceling);
  EXPECT_EQ(cancelReply(CancelCode::Canceling, {cancel}), canceling);
  EXPECT_EQ(readCancelReply(test::bytesFromHex("000100000200000000000000")),
            CancelCode::UnknownGoal);
  const Bytes two = test::bytesFromHex("0001000002000000" + info + "02" + kUuidHex +
                                       "0000000500000006000000" + "05");
  const auto list = readStatusList(
      test::bytesFromHex("0001000002000000" + info + "02" + kUuidHex + "007c07050000000600000005"));
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].goal.uuid, kUuid);
  EXPECT_EQ(list[0].status, 2);
  EXPECT_EQ(list[1].goal.stamp, Stamp::fromParts(5, 6));
  EXPECT_EQ(list[1].status, 5);
  EXPECT_EQ(statusList(list), two);
}

TEST(ActionMessages, ofRos1AreReadAsTheyWereWritten) {
  const ActionGoalStatus active{{{3}, "x"}, GoalState::Active, "on its way"};
  const auto list = readStatusListMessage(statusListMessage({4}, {active, {{{5}, "y"}, {}, ""}}));
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].goal.stamp, Stamp{3});
  EXPECT_EQ(list[0].state, GoalState::Active);
  EXPECT_EQ(list[0].text, "on its way");
  EXPECT_EQ(list[1].goal.id, "y");
  const auto [status, part] = readActionUpdate(actionUpdateMessage({4}, active, {7, 8}));
  EXPECT_EQ(status.goal.id, "x");
  EXPECT_EQ(part, (Bytes{7, 8}));
  Bytes strange = goalIdMessage({});  // as the status of a list without a head
  strange.insert(strange.begin(), {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0});
  strange.insert(strange.end(), {77, 0, 0, 0, 0});
  EXPECT_NE(messageErrorOf([&] {
              readStatusListMessage(strange);
            }).find("holds the status 77, none of actionlib's"),
            std::string::npos);
}

TEST(ActionMessages, refuseBytesThatAreNone) {
  EXPECT_NE(messageErrorOf([] { readStatusList(test::bytesFromHex("00010000ffffffff")); }), "");
  EXPECT_NE(messageErrorOf([] { readCancelRequest({0, 1, 0, 0, 7}); }), "");
  EXPECT_NE(messageErrorOf([] { readIsAccepted({}); }), "");
  EXPECT_NE(messageErrorOf([] { readGoalId(Bytes{0, 0, 0, 0}); }), "");
  EXPECT_NE(messageErrorOf([] { readActionGoal(Bytes(24, 0xff)); }), "");
  EXPECT_NE(messageErrorOf([] { readActionUpdate(Bytes(24, 0xff)); }), "");
  EXPECT_NE(messageErrorOf([] { readStatusListMessage(Bytes(24, 0xff)); }), "");
}

TEST(ActionMessages, nameAGoalByItsUuidAndBack) {
  EXPECT_EQ(goalIdOf(kUuid), kUuidHex);
  EXPECT_EQ(goalUuidOf(kUuidHex), kUuid);
  EXPECT_FALSE(goalUuidOf("/client-1-17.5"));
  EXPECT_FALSE(goalUuidOf("0102030405060708090A0B0C0D0E0F10"));
  EXPECT_FALSE(goalUuidOf(kUuidHex + "00"));
}

TEST_F(ActionTypeTest, hasRos1sMd5sWhereTheFieldsAreTheSame) {
  write("share/control_msgs/msg/GripperCommand.msg",
        "# position\nfloat64 position\nfloat64 max_effort\n");
  write("share/control_msgs/action/GripperCommand.action",
        "GripperCommand command\n---\nfloat64 position\nfloat64 effort\nbool stalled\n"
        "bool reached_goal\n---\nfloat64 position\nfloat64 effort\nbool stalled\n"
        "bool reached_goal\n");
  const ActionType gripper("control_msgs/GripperCommand", *find("control_msgs/GripperCommand"),
                           kNothingKnown);
  EXPECT_EQ(gripper.goal().type, "control_msgs/GripperCommandActionGoal");
  EXPECT_EQ(gripper.goal().md5, "aa581f648a35ed681db2ec0bf7a82bea");
  EXPECT_EQ(gripper.result().md5, "143702cb2df0f163c5283cedc5efc6b6");
  write("share/geometry_msgs/msg/PointStamped.msg", "std_msgs/Header header\nPoint point\n");
  write("share/geometry_msgs/msg/Point.msg", "float64 x\nfloat64 y\nfloat64 z\n");
  write("share/geometry_msgs/msg/Vector3.msg", "float64 x\nfloat64 y\nfloat64 z\n");
  write("share/std_msgs/msg/Header.msg", "builtin_interfaces/Time stamp\nstring frame_id\n");
  write("share/control_msgs/action/PointHead.action",
        "geometry_msgs/PointStamped target\ngeometry_msgs/Vector3 pointing_axis\n"
        "string pointing_frame\nbuiltin_interfaces/Duration min_duration\nfloat64 max_velocity\n"
        "---\n---\nfloat64 pointing_angle_error\n");
  const ActionType head("control_msgs/PointHead", *find("control_msgs/PointHead"), kNothingKnown);
  EXPECT_EQ(head.goal().md5, "b53a8323d0ba7b310ba17a2d3a82a6b8");
  EXPECT_EQ(head.result().md5, "1eb06eeff08fa7ea874431638cb52332");
  EXPECT_EQ(head.whyOwn(), "no ROS 1 type control_msgs/PointHeadActionGoal is known here");
  EXPECT_TRUE(head.noResult().empty());
  EXPECT_EQ(head.readResultReply(test::bytesFromHex("0001000004000000")).first, 4);
}

TEST_F(ActionTypeTest, hasRos2sFieldsWhereRos1KnowsOthers) {
  write("share/a/action/Do.action", "int32 x\nstring who\n---\n---\n");
  const FindDefinition ros1 = [](const std::string& type) -> std::optional<Definition> {
    return Definition{type == "a/DoGoal" ? "int32 x\n" : "", "0"};
  };
  const ActionType type("a/Do", *find("a/Do", ros1), ros1);
  EXPECT_EQ(type.whyOwn(), "ROS 1 has no field goal.who");
  EXPECT_EQ(type.readGoalRequest(type.goalRequest(kUuid, {1, 0, 0, 0, 1, 0, 0, 0, 'y'})).second,
            (Bytes{1, 0, 0, 0, 1, 0, 0, 0, 'y'}));
}

TEST_F(ActionTypeTest, isOfRos1IfItIsNotInstalled) {
  const FindDefinition ros1 = [](const std::string& type) -> std::optional<Definition> {
    return Definition{type == "a/DoGoal" ? "duration x\n" : "", "0"};
  };
  const ActionType type("a/Do", *find("a/Do", ros1), ros1);
  EXPECT_EQ(type.whyOwn(), "");
  EXPECT_EQ(type.goalRequest(kUuid, {1, 0, 0, 0, 2, 0, 0, 0}),
            test::bytesFromHex("00010000" + kUuidHex + "0100000002000000"));
  EXPECT_FALSE(find("a/Do"));
}

TEST_F(ActionTypeTest, followsJointTrajectoriesAsRos1DoesUnlessItAsksForMore) {
  const FindDefinition ros1 = findInstalled();
  if (!ros1("control_msgs/FollowJointTrajectoryActionGoal")) {
    GTEST_SKIP() << "ROS 1's control_msgs are not here";
  }
  const std::string name = "control_msgs/FollowJointTrajectory";
  const ActionType type(name, *find(name, ros1), ros1);
  EXPECT_EQ(type.whyOwn(), "");
  EXPECT_EQ(type.goal().md5, "cff5c1d533bf2f82dd0138d57f4304bb");
  EXPECT_EQ(type.result().md5, "c4fb3b000dc9da4fd99699380efcc5d9");

  const auto request = [](const std::vector<std::string>& multi_dof_joints) {
    test::CdrBytes cdr(false, 0);
    for (const std::uint8_t byte : kUuid) cdr.put(byte);
    cdr.put<std::int32_t>(0).put<std::uint32_t>(0).text("");        // header
    cdr.put<std::uint32_t>(1).text("elbow").put<std::uint32_t>(1);  // joints, points
    cdr.put<std::uint32_t>(1).put(0.5).put<std::uint32_t>(0).put<std::uint32_t>(0);
    cdr.put<std::uint32_t>(0).put<std::int32_t>(2).put<std::uint32_t>(3);  // at 2 s, 3 ns
    cdr.put<std::int32_t>(0).put<std::uint32_t>(0).text("");               // of many axes
    cdr.put(static_cast<std::uint32_t>(multi_dof_joints.size()));
    for (const std::string& joint : multi_dof_joints) cdr.text(joint);
    cdr.put<std::uint32_t>(0);
    for (int tolerances = 0; tolerances < 4; ++tolerances) cdr.put<std::uint32_t>(0);
    cdr.put<std::int32_t>(1).put<std::uint32_t>(0);
    return Bytes(cdr);
  };
  const auto [uuid, goal] = type.readGoalRequest(request({}));
  EXPECT_NE(jsonOf(type.goal(), actionGoalMessage({}, {{}, goal}))
                .find(R"("joint_names":["elbow"],"points":[{"accelerations":[],"effort":[],)"
                      R"("positions":[0.5],"time_from_start":{"nsecs":3,"secs":2})"),
            std::string::npos);
  EXPECT_EQ(type.goalRequest(uuid, goal), request({}));
  EXPECT_NE(messageErrorOf([&] {
              type.readGoalRequest(request({"ball"}));
            }).find("field goal.multi_dof_trajectory.joint_names, at byte"),
            std::string::npos);
}

TEST(ActionFeedback, isInTheDefinitionOfItsMessage) {
  const std::string line = std::string(80, '=') + "\nMSG: ";
  const std::string id = line + "unique_identifier_msgs/msg/UUID\nuint8[16] uuid\n";
  const std::string contained = line + "a/msg/Stage\nstring name\n";
  const std::string message =
      "unique_identifier_msgs/msg/UUID goal_id\na/action/Do_Feedback feedback\n";
  const std::string fields = "int32 index\na/msg/Stage stage\n";
  EXPECT_EQ(actionFeedbackIn(message + contained + line + "a/action/Do_Feedback\n" + fields + id,
                             "a/action/Do"),
            fields + contained + id);
  EXPECT_EQ(messageErrorOf([&] { actionFeedbackIn(message + contained + id, "a/action/Do"); }),
            "the definition of its feedback's message has no a/action/Do_Feedback");
}

}  // namespace
}  // namespace afterglow::replay::action_type_test
