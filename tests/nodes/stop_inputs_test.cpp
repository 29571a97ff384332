// The words by which the ways to stop a replay are named, and which of its topics drives the base.
#include "nodes/player/stop_inputs.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "tests/support/messages.hpp"

namespace afterglow::nodes::stop_inputs_test {
namespace {

EmergencyStopOptions stopOf(const std::string& text) {
  EmergencyStopOptions options;
  options.profile = "fetch";
  options.set(text);
  return options;
}

TEST(EmergencyStopOptions, areATopicAndAFieldThatStopsByBeingTrueOrFalse) {
  EXPECT_EQ(stopOf("/estop").topic, "/estop");
  EXPECT_EQ(stopOf("/estop").field, "");
  EXPECT_TRUE(stopOf("/estop").stops_when);
  EXPECT_EQ(stopOf("/estop").profile, "") << "it is not the profile's any more";
  EXPECT_EQ(stopOf("/robot_state:runstopped").field, "runstopped");
  EXPECT_TRUE(stopOf("/robot_state:runstopped").stops_when);
  EXPECT_EQ(stopOf("/power_board/state:!run_stop").topic, "/power_board/state");
  EXPECT_EQ(stopOf("/power_board/state:!run_stop").field, "run_stop");
  EXPECT_FALSE(stopOf("/power_board/state:!run_stop").stops_when);
  EXPECT_EQ(stopOf("none").topic, "");
  for (const char* text : {"/estop", "/robot_state:runstopped", "/a/b:!c.d", "none"}) {
    EXPECT_EQ(stopOf(text).text(), text);
  }
  for (const char* text : {"", "/", "estop", "estop:field", "/estop:", "/estop:!", ":field"}) {
    EXPECT_THROW(stopOf(text), std::invalid_argument) << text;
  }
}

TEST(HoldButtonOptions, areATopicAndANumber) {
  HoldButtonOptions options;
  options.set("/joy:10");
  EXPECT_EQ(options.topic, "/joy");
  EXPECT_EQ(options.button, 10u);
  for (const char* text :
       {"", "/joy", "joy:1", "/joy:", "/joy:-1", "/joy:1x", "/joy:a", ":1", "7"}) {
    EXPECT_THROW(options.set(text), std::invalid_argument) << text;
  }
  EXPECT_EQ(options.button, 10u) << "a refused one changes nothing";
}

/// A plan that plays velocities on these topics, with an arm that is none, and one that is left
/// out.
replay::PlayPlan planOf(const std::vector<std::string>& topics) {
  replay::PlayPlan plan;
  replay::PlannedTopic planned;
  planned.channel = planned.output = test::trajectoryGoalChannel("/arm/goal");
  plan.topics.push_back(planned);
  planned.channel = planned.output = test::twistChannel("/left_out");
  planned.why_not = "it was excluded";
  plan.topics.push_back(planned);
  planned.why_not.clear();
  for (const std::string& topic : topics) {
    planned.channel = planned.output = test::twistChannel(topic);
    plan.topics.push_back(planned);
  }
  return plan;
}

TEST(BaseTopic, isTheNamedOneElseTheProfilesElseTheOnlyOne) {
  const replay::PlayPlan one = planOf({"/drive"}), two = planOf({"/drive", "/other"});
  EXPECT_EQ(baseTopic(one, "", ""), "/drive");
  EXPECT_EQ(baseTopic(one, "", "/cmd_vel"), "/drive");
  EXPECT_EQ(baseTopic(two, "", "/cmd_vel"), "") << "it is not known which";
  EXPECT_EQ(baseTopic(two, "", "/other"), "/other");
  EXPECT_EQ(baseTopic(two, "/drive", "/other"), "/drive");
  EXPECT_EQ(baseTopic(two, "/left_out", "/other"), "/other");
  EXPECT_EQ(baseTopic(planOf({}), "", "/left_out"), "");
}

TEST(BaseTopic, isFoundByItsRecordedNameAndTellsItsPublishedOne) {
  replay::PlayPlan plan = planOf({"/drive", "/other"});
  plan.topics.back().output.topic = "/renamed";
  EXPECT_EQ(baseTopic(plan, "/other", ""), "/renamed");
  EXPECT_EQ(baseTopic(plan, "/renamed", ""), "/renamed");
}

}  // namespace
}  // namespace afterglow::nodes::stop_inputs_test
