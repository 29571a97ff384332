#include "nodes/player/play_options.hpp"

#include <gtest/gtest.h>

#include <array>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace afterglow::nodes::play_options_test {
namespace {

using Texts = std::vector<std::string>;

ReplayRequest asked(const Texts& options) {
  ReplayRequest request;
  giveGoalOptions(request, options);
  return request;
}

/// Why a goal's options are refused; empty: they are not.
std::string refusal(const Texts& options) {
  try {
    asked(options);
    return "";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST(PlayOptions, haveANameEachThatNoOtherHasAndAValueThatIsExplained) {
  std::set<std::string> names;
  for (const PlayOption& option : playOptions()) {
    EXPECT_TRUE(names.insert(option.name).second) << option.name;
    const bool is_taken = !option.aliases.empty() && !names.insert(option.aliases).second;
    EXPECT_FALSE(is_taken) << option.name;
    EXPECT_EQ(option.value.empty(), option.kind == PlayOption::Kind::Flag) << option.name;
    EXPECT_FALSE(option.help.empty()) << option.name;
  }
  for (const FormerOption& former : formerOptions()) {
    EXPECT_EQ(names.count(former.name), 0u);
    EXPECT_EQ(names.count(former.now), 1u);
  }
}

TEST(PlayOptions, takeNumbersUpToTheirBounds) {
  const auto isTaken = [](const std::string& name, const std::string& text) {
    for (const PlayOption& option : playOptions()) {
      if (option.name == name) return complaintOf(option, text).empty();
    }
    throw std::logic_error("no option " + name);
  };
  const std::vector<std::array<const char*, 5>> bounds = {
      // below, least, most, above
      {"longest_stall", "0.0399", "0.04", "10", "10.01"},
      {"estop_longest_silence", "0.0099", "0.01", "60", "60.01"},
      {"clearance", "-0.01", "0", "2", "2.01"},
      {"queue", "0", "1", "1000000", "1000001"},
      {"rate", "0.00099", "0.001", "1000", "1001"},
      {"obstacle_wait", "-0.01", "0", "1000000", "inf"}};
  for (const auto& [name, below, least, most, above] : bounds) {
    EXPECT_FALSE(isTaken(name, below)) << name;
    EXPECT_TRUE(isTaken(name, least)) << name;
    EXPECT_TRUE(isTaken(name, most)) << name;
    EXPECT_FALSE(isTaken(name, above)) << name;
    for (const char* none : {"", "1 m", "nan"}) EXPECT_FALSE(isTaken(name, none)) << name;
  }
  EXPECT_FALSE(isTaken("queue", "1.5"));
  EXPECT_TRUE(isTaken("no_scan", "true"));
  EXPECT_TRUE(isTaken("no_scan", "false"));
  EXPECT_FALSE(isTaken("no_scan", "yes"));
}

TEST(PlayOptions, ofAGoalSetWhatTheyName) {
  const ReplayRequest request =
      asked({"only=ar,speech", "start=1.5", "rate=0.5", "pause", "loop=true", "ungated",
             "keep_light", "unheard=abort", "latency=ar=0.05,speech=0.2", "remap=/a:=/b",
             "anchor=/path=body", "sim", "hz=50"});
  EXPECT_EQ(request.only, "ar,speech");
  EXPECT_EQ(request.plan.start_s, 1.5);
  EXPECT_EQ(request.options.rate, 0.5);
  EXPECT_TRUE(request.options.starts_paused);
  EXPECT_TRUE(request.options.is_looping);
  EXPECT_FALSE(request.options.is_in_step);
  EXPECT_FALSE(request.options.clear_projection);
  EXPECT_TRUE(request.needs_subscribers);
  EXPECT_EQ(request.options.latency_s, replay::parseLatency({"ar=0.05", "speech=0.2"}));
  EXPECT_EQ(request.plan.remap.at("/a"), "/b");
  EXPECT_EQ(request.anchors.topics.at("/path"), replay::Anchor::Body);
  EXPECT_EQ(request.clock, ReplayClock::Sim);
  EXPECT_EQ(request.clock_hz, 50);
}

TEST(PlayOptions, thatAreNotGivenStayAsTheyWereAndZeroIsAValue) {
  ReplayRequest request;
  request.options.seek_lead_s = 3;
  request.options.goal_wait_s = 4;
  request.wait_for_subscribers_s = 5;
  request.options.keeps_alive = true;
  giveGoalOptions(request, {"seek_lead=0", "wait-for-subscribers=0", "keep_alive=false"});
  EXPECT_EQ(request.options.seek_lead_s, 0);
  EXPECT_EQ(request.wait_for_subscribers_s, 0);
  EXPECT_FALSE(request.options.keeps_alive);
  EXPECT_EQ(request.options.goal_wait_s, 4);
  EXPECT_FALSE(request.plan.duration_s);
  EXPECT_EQ(refusal({"duration=0"}), "duration: 0 is no number of 0.001 to 1000000000");
  EXPECT_EQ(asked({"duration=1200"}).plan.duration_s, 1200) << "twenty minutes";
  EXPECT_EQ(refusal({"skip_empty=1e300"}), "skip_empty: 1e300 is no number of 0.001 to 1000000000");
  for (const char* rate : {"0", "1e-300", "1e300", "-1", "nan", "0.0009", "1000.1"}) {
    EXPECT_EQ(refusal({std::string("rate=") + rate}),
              "rate: " + std::string(rate) + " is no number of 0.001 to 1000");
  }
}

TEST(PlayOptions, thatAreListsComeTogetherOrOneByOne) {
  EXPECT_EQ(asked({"also=/a,/b", "also=/c"}).plan.also,
            (std::vector<replay::TopicName>{"/a", "/b", "/c"}));
  EXPECT_TRUE(asked({"also="}).plan.also.empty());
}

TEST(PlayOptions, areCalledAsOnTheCommandLineOfRosbagToo) {
  EXPECT_EQ(asked({"clock"}).clock, ReplayClock::Sim);
  EXPECT_EQ(asked({"follow-clock"}).clock, ReplayClock::Follow);
}

TEST(PlayOptions, thatAreNamesAreCleanAndValid) {
  const std::string clean = "'//joy' is no clean name: '/joy' is";
  for (const std::string option :
       {"also", "topics", "exclude", "pause_topics", "rate_control_topic"}) {
    EXPECT_EQ(refusal({option + "=//joy"}), option + ": " + clean);
  }
  EXPECT_EQ(refusal({"remap=/joy:=//joy"}), "remap: " + clean);
  EXPECT_EQ(refusal({"remap=//joy:=/joy"}), "remap: " + clean);
  EXPECT_EQ(refusal({"prefix=/"}), "prefix: '/' is no topic: a slash is no name");
  EXPECT_EQ(refusal({"prefix=/then/"}), "prefix: '/then/' is no clean name: '/then' is");
}

TEST(PlayOptions, ofAGoalAreRefusedInOneLine) {
  EXPECT_EQ(refusal({"ratte=2"}), "a replay has no option 'ratte'; did you mean rate?");
  EXPECT_EQ(refusal({"only=ar", "speech"}), "a replay has no option 'speech'");
  EXPECT_EQ(refusal({"paused"}), "paused has become pause");
  EXPECT_EQ(refusal({"rate"}), "rate needs a value: rate=FACTOR");
  EXPECT_EQ(refusal({"rate=1", "rate=2"}), "rate is given twice");
  EXPECT_EQ(refusal({"rate=quick"}), "rate: quick is no number of 0.001 to 1000");
  EXPECT_EQ(refusal({"pause=yes"}), "pause: yes is neither true nor false");
  EXPECT_EQ(refusal({"only=dance"}), "only: 'dance' is no modality (body, light or ar, speech)");
  EXPECT_EQ(refusal({"unheard=never"}), "unheard: never not in {start,abort}");
  EXPECT_EQ(refusal({"sim", "follow_clock"}), "follow_clock excludes sim");
  EXPECT_EQ(refusal({"sim=false", "follow_clock"}), "");
}

TEST(PlayOptions, ofTheRobotAreNotForGoals) {
  EXPECT_EQ(refusal({"allow_motion"}),
            "allow_motion is for the player's parameter ~allow_motion, not for a goal");
  for (const PlayOption& option : playOptions()) {
    if (option.group != PlayGroup::Robot) continue;
    EXPECT_NE(refusal({option.name + "=1"}).find("not for a goal"), std::string::npos);
  }
}

TEST(PlayOptions, ofKeysSetOneOfThemEach) {
  ReplayRequest request;
  for (const PlayOption& option : playOptions()) {
    if (option.name != "start_tolerance") continue;
    EXPECT_EQ(option.otherwise, "0.05 0.02 0.01 0.05 0.0524");
    giveOption(request, option, {"base=0.1", "gripper=0"});
    EXPECT_THROW(giveOption(request, option, {"arm=1"}), std::invalid_argument);
    EXPECT_THROW(giveOption(request, option, {"base=-1"}), std::invalid_argument);
  }
  EXPECT_EQ(request.body.tolerances.base, 0.1);
  EXPECT_EQ(request.body.tolerances.gripper, 0);
  EXPECT_EQ(request.body.tolerances.turning, 0.05);
}

TEST(PlayOptions, thatAreFlagsCanBeTakenBack) {
  ReplayRequest request;
  const auto give = [&](const std::string& name, const std::string& text) {
    for (const PlayOption& option : playOptions()) {
      if (option.name == name) giveOption(request, option, {text});
    }
  };
  give("to_start", "true");
  give("any_start", "false");
  EXPECT_EQ(request.body.start, BodyOptions::Start::MoveThere);
  give("to_start", "false");
  EXPECT_EQ(request.body.start, BodyOptions::Start::AsRecorded);
  give("realtime", "false");
  EXPECT_FALSE(request.is_realtime);
}

/// What an owner gives, who may give more than a goal.
ReplayRequest owned(const std::vector<std::pair<std::string, std::string>>& given) {
  ReplayRequest request;
  for (const PlayOption& option : playOptions()) {
    for (const auto& [name, value] : given) {
      if (name == option.name) giveOption(request, option, {value});
    }
  }
  return request;
}

TEST(PlayOptions, ofTheOwnerHaveCleanNamesToo) {
  for (const char* option : {"scan", "base_topic"}) {
    EXPECT_THROW(owned({{option, "//joy"}}), std::invalid_argument) << option;
  }
  EXPECT_THROW(owned({{"estop_topic", "/robot//halted"}}), std::invalid_argument);
  EXPECT_THROW(owned({{"hold_to_run", "//joy:10"}}), std::invalid_argument);
}

TEST(PlayOptions, nameAnEmergencyStopByAFieldOfItsMessages) {
  const auto stop = [](const std::string& text) {
    return owned({{"estop_topic", text}}).body.stops.emergency_stop;
  };
  EXPECT_EQ(stop("/estop").topic, "/estop");
  EXPECT_EQ(stop("/estop").field, "");
  EXPECT_EQ(stop("/board/state:a.run_stop").field, "a.run_stop");
  EXPECT_TRUE(stop("/board/state:run_stop").stops_when);
  EXPECT_FALSE(stop("/board/state:!run_stop").stops_when);
  EXPECT_EQ(stop("/board/state:!run_stop").text(), "/board/state:!run_stop");
  EXPECT_EQ(stop("none").topic, "");
  for (const char* wrong : {"estop", "/", "/estop:", "/estop:!", "none:x", ""}) {
    EXPECT_THROW(stop(wrong), std::invalid_argument) << wrong;
  }
}

TEST(PlayOptions, obeyTheEmergencyStopOfAProfileUnlessAnotherIsNamed) {
  const auto stop = [](const std::vector<std::pair<std::string, std::string>>& given) {
    return owned(given).body.stops.emergency_stop;
  };
  EXPECT_EQ(stop({{"robot", "fetch"}}).text(), "/robot_state:runstopped");
  EXPECT_EQ(stop({{"robot", "fetch"}}).profile, "fetch");
  EXPECT_EQ(stop({{"estop_topic", "/mine"}, {"robot", "fetch"}}).text(), "/mine");
  EXPECT_EQ(stop({{"estop_topic", "/mine"}, {"robot", "fetch"}}).profile, "");
  EXPECT_EQ(stop({{"estop_topic", "none"}, {"robot", "fetch"}}).topic, "");
}

TEST(PlayOptions, nameAButtonOfAJoystick) {
  const HoldButtonOptions button =
      owned({{"hold_to_run", "/joys/left:12"}}).body.stops.hold_button;
  EXPECT_EQ(button.topic, "/joys/left");
  EXPECT_EQ(button.button, 12u);
  for (const char* wrong : {"/joy", "/joy:", "/joy:a", "/joy:-1", "/joy:1x", "joy:1", ":1", ""}) {
    EXPECT_THROW(owned({{"hold_to_run", wrong}}), std::invalid_argument) << wrong;
  }
}

}  // namespace
}  // namespace afterglow::nodes::play_options_test
