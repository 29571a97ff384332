// ask_node from outside: its action, its topic, and what it asks of the player.
#include <actionlib/server/simple_action_server.h>
#include <afterglow/AskActionGoal.h>
#include <afterglow/AskActionResult.h>
#include <afterglow/ReplayAction.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "replay/store/open/open_store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::ask_node_ros_test {
namespace {

using test::eventually;
using Texts = std::vector<std::string>;

constexpr std::int64_t kSecond = 1'000'000'000;
const Texts kLightAndSpeech{"only=ar,speech"}, kAll{};

constexpr const char* kQuestions = R"(questions:
  - {behavior: pick, motion: true, ask: [what did you pick]}
  - {behavior: drive, ask: [why did you not go straight]}
  - {behavior: "*", answer: words, ask: [what did you do]}
)";

/// A pick and, after it, a drive.
std::map<std::string, std::int64_t> recordTwo(const std::string& path) {
  const auto store = replay::openStore(path, replay::OpenMode::ReadWrite);
  const std::int64_t recording = store->addRecording({0, "", "by hand", ""});
  std::map<std::string, std::int64_t> ids;
  std::int64_t begin = 1000 * kSecond;
  for (const char* name : {"pick", "drive"}) {
    auto behavior = test::sampleBehavior(recording, {"/say"}, begin, begin + 10 * kSecond);
    behavior.name = name;
    ids[name] = store->addBehavior(behavior);
    begin += 60 * kSecond;
  }
  return ids;
}

/// A player that does as it is told, or refuses, and remembers what it was asked for.
class PretendPlayer {
 public:
  PretendPlayer() { server_.start(); }
  void refuse(bool refuses) {
    const std::lock_guard<std::mutex> lock(mutex_);
    refuses_ = refuses;
  }
  void refuseMotion() {
    const std::lock_guard<std::mutex> lock(mutex_);
    refuses_motion_ = true;
  }
  void stopOnTheWay() {
    const std::lock_guard<std::mutex> lock(mutex_);
    stops_ = true;
  }
  std::vector<ReplayGoal> goals() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return goals_;
  }

 private:
  void onGoal(const ReplayGoalConstPtr& goal) {
    const std::lock_guard<std::mutex> lock(mutex_);
    goals_.push_back(*goal);
    const bool is_refused = refuses_ || (refuses_motion_ && goal->options.empty());
    ReplayResult stopped;
    stopped.behavior_id = stops_ ? 1 : 0;  // as player_node has it: none for what never began
    is_refused || stops_ ? server_.setAborted(stopped, "its arm is elsewhere")
                         : server_.setSucceeded();
  }

  std::mutex mutex_;
  bool refuses_ = false, refuses_motion_ = false, stops_ = false;
  std::vector<ReplayGoal> goals_;
  ros::NodeHandle node_;
  actionlib::SimpleActionServer<ReplayAction> server_{
      node_, "replay", [this](const ReplayGoalConstPtr& goal) { onGoal(goal); }, false};
};

/// A person before a robot whose ask_node runs in a process of its own.
struct AskNodeRos : testing::Test {
  static void SetUpTestSuite() {
    graph = new test::TestGraph;
    ros::start();
    spinner = new ros::AsyncSpinner(2);
    spinner->start();
  }
  static void TearDownTestSuite() {
    if (spinner == nullptr) return;  // there is no master
    delete spinner;
    ros::shutdown();
    delete graph;
  }
  void SetUp() override {
    test::writeFile(folder.path("questions.yaml"), kQuestions);
    ids = recordTwo(store);
    allowPlayer(false);
    start({});
  }
  void TearDown() override { stop(); }

  void start(const Texts& more) {
    Texts words{AFTERGLOW_TEST_ASK_NODE, "_store:=" + store,
                "_questions:=" + folder.path("questions.yaml")};
    words.insert(words.end(), more.begin(), more.end());
    process = std::make_unique<test::NodeProcess>(words);
    ASSERT_TRUE(eventually([&] {
      return goals.getNumSubscribers() > 0 && heard.getNumSubscribers() > 0 &&
             answers.getNumPublishers() > 0 && speech.getNumPublishers() > 0;
    })) << process->log();
  }
  void stop() {
    process->interrupt();
    process->exitStatus();
    EXPECT_TRUE(eventually([&] {
      return goals.getNumSubscribers() == 0 && answers.getNumPublishers() == 0;
    }));
  }
  void allowPlayer(bool allows) { node.setParam("/player_node/allow_motion", allows); }

  /// By the action.
  AskResult ask(const std::string& question) {
    AskActionGoal goal;
    goal.goal_id.id = "question " + std::to_string(++asked);
    goal.header.stamp = goal.goal_id.stamp = ros::Time::now();
    goal.goal.question = question;
    goals.publish(goal);
    return answerTo(goal.goal_id.id);
  }
  /// Of a goal whose id begins so.
  AskResult answerTo(const std::string& id) {
    std::optional<AskResult> found;
    EXPECT_TRUE(eventually([&] {
      const std::lock_guard<std::mutex> lock(mutex);
      for (const AskActionResult& result : results) {
        if (result.status.goal_id.id.rfind(id, 0) == 0) found = result.result;
      }
      return found.has_value();
    })) << "no answer; " << process->log();
    return found.value_or(AskResult());
  }
  bool says(const std::string& sentence) {
    return eventually([&] {
      const std::lock_guard<std::mutex> lock(mutex);
      return std::count(said.begin(), said.end(), sentence) > 0;
    });
  }

  static test::TestGraph* graph;
  static ros::AsyncSpinner* spinner;
  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  std::map<std::string, std::int64_t> ids;
  std::mutex mutex;
  std::vector<AskActionResult> results;
  Texts said;
  int asked = 0;
  ros::NodeHandle node;
  PretendPlayer player;
  ros::Publisher goals = node.advertise<AskActionGoal>("/ask/goal", 5);
  ros::Publisher heard = node.advertise<std_msgs::String>("/ask_node/ask", 5);
  ros::Subscriber answers =
      node.subscribe<AskActionResult>("/ask/result", 10, [this](const auto& result) {
        const std::lock_guard<std::mutex> lock(mutex);
        results.push_back(*result);
      });
  ros::Subscriber speech =
      node.subscribe<sound_play::SoundRequest>("/robotsound", 10, [this](const auto& request) {
        const std::lock_guard<std::mutex> lock(mutex);
        said.push_back(request->arg);
      });
  std::unique_ptr<test::NodeProcess> process;
};
test::TestGraph* AskNodeRos::graph = nullptr;
ros::AsyncSpinner* AskNodeRos::spinner = nullptr;

TEST_F(AskNodeRos, answersByAReplayOfLightAndSpeech) {
  const AskResult answer = ask("What did you pick?");
  EXPECT_EQ(answer.answer, AskResult::REPLAYED) << answer.sentence << process->log();
  EXPECT_EQ(answer.behavior_id, ids["pick"]);
  EXPECT_FALSE(answer.moved);
  EXPECT_EQ(answer.why, "matched 'what did you pick' -> pick");
  ASSERT_EQ(player.goals().size(), 1u);
  EXPECT_EQ(player.goals()[0].behavior, std::to_string(ids["pick"]));
  EXPECT_EQ(player.goals()[0].options, kLightAndSpeech);
}

TEST_F(AskNodeRos, hearsASpeechRecognizer) {
  std_msgs::String text;
  text.data = "why didn't you go straight";
  heard.publish(text);
  const AskResult answer = answerTo("/ask_node-");
  EXPECT_EQ(answer.answer, AskResult::REPLAYED) << answer.sentence;
  EXPECT_EQ(answer.behavior_id, ids["drive"]);
}

TEST_F(AskNodeRos, movesTheRobotWhereQuestionNodeAndPlayerAllowIt) {
  allowPlayer(true);
  EXPECT_FALSE(ask("what did you pick").moved) << "the node does not allow it";
  stop();
  start({"_allow_motion:=true"});
  EXPECT_TRUE(ask("what did you pick").moved);
  EXPECT_FALSE(ask("why did you not go straight").moved) << "the question does not allow it";
  allowPlayer(false);
  EXPECT_FALSE(ask("what did you pick").moved) << "the player does not allow it";
  std::vector<Texts> options;
  for (const ReplayGoal& goal : player.goals()) options.push_back(goal.options);
  EXPECT_EQ(options, (std::vector<Texts>{kLightAndSpeech, kAll, kLightAndSpeech,
                                         kLightAndSpeech}));
}

TEST_F(AskNodeRos, announcesAnAnswerThatMoves) {
  allowPlayer(true);
  stop();
  start({"_allow_motion:=true"});
  EXPECT_TRUE(ask("what did you pick").moved);
  EXPECT_TRUE(says("Let me show you."));
}

TEST_F(AskNodeRos, showsLightWhereMotionIsRefused) {
  allowPlayer(true);
  player.refuseMotion();
  stop();
  start({"_allow_motion:=true"});
  const AskResult answer = ask("what did you pick");
  EXPECT_EQ(answer.answer, AskResult::REPLAYED) << answer.sentence << process->log();
  EXPECT_FALSE(answer.moved);
  ASSERT_EQ(player.goals().size(), 2u);
  EXPECT_EQ(player.goals()[0].options, kAll);
  EXPECT_EQ(player.goals()[1].options, kLightAndSpeech);
}

TEST_F(AskNodeRos, doesNotGoOnInLightAfterAStop) {
  allowPlayer(true);
  player.stopOnTheWay();
  stop();
  start({"_allow_motion:=true"});
  const AskResult answer = ask("what did you pick");
  EXPECT_EQ(answer.answer, AskResult::TOLD);
  EXPECT_FALSE(answer.moved);
  EXPECT_EQ(player.goals().size(), 1u);
}

TEST_F(AskNodeRos, asksBackWhenTwoFitAndUnderstandsWhichOne) {
  const AskResult back = ask("what did you do");
  EXPECT_EQ(back.answer, AskResult::ASKED_BACK);
  EXPECT_EQ(back.behavior_id, 0);
  EXPECT_EQ(back.sentence.rfind("Do you mean drive, ", 0), 0u) << back.sentence;
  EXPECT_TRUE(says(back.sentence));
  const AskResult answer = ask("the pick");
  EXPECT_EQ(answer.answer, AskResult::TOLD);
  EXPECT_EQ(answer.behavior_id, ids["pick"]);
  EXPECT_TRUE(says(answer.sentence)) << "the question asks for words";
  EXPECT_TRUE(player.goals().empty());
}

TEST_F(AskNodeRos, saysThatItKnowsNoAnswer) {
  const AskResult answer = ask("how is the weather");
  EXPECT_EQ(answer.answer, AskResult::UNKNOWN);
  EXPECT_EQ(answer.behavior_id, 0);
  EXPECT_TRUE(says(answer.sentence));
  EXPECT_TRUE(player.goals().empty());
}

TEST_F(AskNodeRos, tellsWhatThePlayerDoesNotReplay) {
  player.refuse(true);
  const AskResult answer = ask("what did you pick");
  EXPECT_EQ(answer.answer, AskResult::TOLD);
  EXPECT_FALSE(answer.moved);
  EXPECT_EQ(answer.sentence.rfind("That was pick, ", 0), 0u) << answer.sentence;
  EXPECT_TRUE(says(answer.sentence));
}

}  // namespace
}  // namespace afterglow::nodes::ask_node_ros_test
