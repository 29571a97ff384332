// A replay's report for people: the page, the text, and the errors at the end.
#include <gtest/gtest.h>

#include "nodes/pages/replay_page.hpp"
#include "nodes/player/replay_session.hpp"
#include "nodes/verbs/replay_text.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "tests/support/made_up_replay.hpp"
#include "tests/support/markup.hpp"

namespace afterglow::nodes::replay_report_test {
namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(TimeLeft, isWhatTheRestWillTakeAtTheSamePace) {
  EXPECT_EQ(timeLeft(0.5, 20), "20 s left");
  EXPECT_EQ(timeLeft(0.25, 60), "3 min 0 s left");
  EXPECT_EQ(timeLeft(0.02, 120), "1 h 38 min left");
  EXPECT_EQ(timeLeft(0.5, 1), "") << "too early to tell";
  EXPECT_EQ(timeLeft(0, 10), "");
  EXPECT_EQ(timeLeft(1, 10), "0 s left");
}

TEST(ReplayPage, isWellFormedWhateverNamesSay) {
  replay::PlayReport report = test::madeUpReplay();
  report.topics[0].first.channel.topic = "/<script>&\"";
  report.goal_spans[0].topic = report.topics[0].first.channel.topic;
  report.in_step.waits[0].what = "</svg>";
  report.failures[replay::Modality::Ar].first = "<b>";
  report.notes.push_back("\xFF<i>");
  const std::string page = replayPage({report, test::madeUpReplay()}, "<today>");
  EXPECT_EQ(test::markupProblem(page), "");
  for (const char* raw : {"<script>", "<the>", "<b>", "<i>", "<today>", "\xFF", "http"}) {
    EXPECT_FALSE(has(page, raw)) << raw;
  }
  EXPECT_TRUE(has(page, "pick &lt;the&gt; &quot;red&quot; &amp; the 'blue' (7)"));
}

TEST(ReplayPage, showsWhatWasMeasured) {
  const std::string page = replayPage({test::madeUpReplay()}, "today");
  for (const char* part :
       {"What was sent when", "Lateness", "In step", "The body's end", "Topics", "Not played",
        "Rewritten", "p99 1.24 ms on /points", "points: 12 bytes are missing", "2.50 s",
        "driven along its track", "of 479 messages, 5 skipped", "0.8 cm, 0.3°", "-0.69°",
        "+2.0 mm", "states are never replayed", "shifted to now",
        "nobody was there for /robotsound", "at most 4.3 cm off it"}) {
    EXPECT_TRUE(has(page, part)) << part;
  }
}

TEST(ReplayPage, beginsWithAVerdictAndTellsFailuresApartFromFacts) {
  replay::PlayReport report = test::madeUpReplay();
  report.notes.push_back("the base was driven to the start");
  const std::string page = replayPage({report}, "");
  const auto at = [&page](const std::string& part) { return page.find(part); };
  ASSERT_NE(at("<p class=\"verdict careful\">Completed, with "), std::string::npos);
  EXPECT_LT(at("verdict careful"), at("What failed"));
  EXPECT_LT(at("What failed"), at("/points</strong>: 0 skipped, 2 refused: points: 12 bytes"));
  EXPECT_LT(at("What failed"), at("class=\"facts\""));
  EXPECT_LT(at("Good to know"), at("the base was driven to the start"));
  EXPECT_LT(at("class=\"facts\""), at("Good to know"));
  report.failures.clear();
  report.goals.failed = 0;
  for (auto& [topic, played] : report.topics) played.skipped = played.refused = 0;
  EXPECT_TRUE(has(replayPage({report}, ""), "verdict good\">Completed, without a failure."));
}

TEST(ReplayPage, saysWhoStopsTheRobotWhenThePlayerIsGone) {
  replay::PlayReport report = test::madeUpReplay();
  report.guards = replay::PlayGuards{62.4, 2.1, 0, {}};
  EXPECT_TRUE(has(replayPage({report}, ""), "this machine was up to 2.1 ms late"));
  EXPECT_TRUE(has(replayPage({report}, ""), "<dt>Guard on the robot</dt><dd>none</dd>"));
  report.guards->on_robot = replay::PlayGuards::OnRobot{"/afterglow_guard", 340, 30, true};
  const std::string page = replayPage({report}, "");
  EXPECT_TRUE(has(page, "62 ms"));
  EXPECT_TRUE(has(page, "340 ms<br/><small>/afterglow_guard, over the network"));
}

TEST(ReplayPage, leavesOutWhatWasNotMeasured) {
  replay::PlayReport report;
  report.behavior_name = "say";
  report.reason = "stopped by a signal";
  const std::string page = replayPage({report}, "");
  EXPECT_EQ(test::markupProblem(page), "");
  EXPECT_TRUE(has(page, "Stopped: stopped by a signal"));
  EXPECT_FALSE(has(page, "<svg"));
  EXPECT_FALSE(has(page, "In step"));
}

TEST(ReplayPage, staysSmallForLongReplays) {
  replay::PlayReport report = test::madeUpReplay();
  test::addTopic(report, "/scan", replay::Modality::Ar, 1000, 0, 600);
  report.planned_ns = 600'000'000'000;
  EXPECT_LE(report.topics.back().second.moments.kept().size(), replay::Samples::kMost);
  EXPECT_LT(replayPage({report}, "").size(), 300'000u);
}

TEST(ReplayText, saysWhatAPersonWantsToKnow) {
  const std::string text = replayText(test::madeUpReplay());
  for (const char* part :
       {"was replayed in 14.50 s, planned 12.00 s\n",
        "   200    -         -      -       -  /cmd_vel\n",
        "replaced   120 on /cmd_vel: the base was driven along its track\n",
        "   115  115     0.041  0.052   1.242  /projection/markers\n",
        "skipped    3 on /projection/markers: too late, and overtaken or dangerous\n",
        "refused    2 on /points: points: 12 bytes are missing\n",
        "goals      1 sent, 1 succeeded\n", "in step    1 wait, 2.50 s, the longest 2.50 s\n",
        "for /arm_controller/follow_joint_trajectory/goal\n", "skew       ar p50 ",
        "base       0.8 cm and 0.3 deg off its recorded end\n",
        "joints     worst -0.69 deg, elbow_flex_joint, of 2\n", "rewritten  35 shifted to now\n",
        "failed     speech: nobody was there for /robotsound\n"}) {
    EXPECT_TRUE(has(text, part)) << part << "\nin\n" << text;
  }
  EXPECT_FALSE(has(text, "/joint_states")) << "it was not played";
}

TEST(ReplayText, saysWhatASeekSentAgain) {
  replay::PlayReport report = test::madeUpReplay();
  auto& [markers, played] = report.topics[2];
  played.published = markers.count + 2;
  const std::string text = replayText(report);
  EXPECT_TRUE(has(text, "repeated   2 on /projection/markers: sent again, as a seek wants it\n"))
      << text;
}

TEST(ReplayText, hasNoLinesForWhatWasNotMeasured) {
  replay::PlayReport report;
  report.behavior_id = 3;
  report.behavior_name = "say";
  report.scheduling = "normal";
  EXPECT_EQ(replayText(report),
            "behavior 3 'say' was stopped after 0.00 s, planned 0.00 s\n"
            "  sent  of  late p50  p99  max ms  topic\n");
  EXPECT_EQ(replayRemarks(report), std::vector<std::string>{"scheduling was normal"});
}

TEST(EndPose, isComparedJointByJointTheShortWayRound) {
  replay::StartPose then, now;
  then.joints = {{"wrist_roll_joint", 3.1}, {"torso_lift_joint", 0.3}, {"elbow_flex_joint", 1}};
  now.joints = {{"wrist_roll_joint", -3.1}, {"torso_lift_joint", 0.28}};
  then.base = replay::PlanarPose{1, 2, 3.1};
  now.base = replay::PlanarPose{1.03, 2.04, -3.1};
  replay::RobotJoint endless;
  endless.kind = replay::RobotJoint::Kind::Endless;
  then.robot = replay::RobotJoints("arm", {{"wrist_roll_joint", endless}}, {});
  const replay::BodyEnd end = compareEnds(then, now);
  EXPECT_NEAR(end.joints.at("wrist_roll_joint"), 2 * replay::kPi - 6.2, 1e-9);
  EXPECT_NEAR(end.joints.at("torso_lift_joint"), -0.02, 1e-9);
  EXPECT_EQ(end.joints.count("elbow_flex_joint"), 0u);
  EXPECT_EQ(end.remarks,
            std::vector<std::string>{"nobody told where elbow_flex_joint was at the end"});
  EXPECT_NEAR(end.base.value().distance, 0.05, 1e-9);
  EXPECT_NEAR(end.base.value().turn, 2 * replay::kPi - 6.2, 1e-9);
  EXPECT_EQ(worstJoint(end).value().first, "wrist_roll_joint");
}

}  // namespace
}  // namespace afterglow::nodes::replay_report_test
