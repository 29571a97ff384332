// What the statuses of a tree's nodes mean for recordings and for the transitions that are
// published.
#include "afterglow/tree_watch.hpp"

#include <gtest/gtest.h>

#include "tests/support/memory_recorder.hpp"

namespace afterglow::nodes::tree_watch_test {
namespace {

using test::Calls;

/// collect / (Retry / pick up) , place , place
const std::vector<WatchedNode> kNodes = {{"collect", "Sequence", 1, {}},
                                         {"Retry", "RetryUntilSuccessful", 2, 0},
                                         {"pick up", "Action", 3, 1},
                                         {"place", "Action", 4, 0},
                                         {"place", "Action", 5, 0}};
enum Index : std::size_t { kCollect, kRetry, kPick, kPlace, kPlaceAgain };

struct Watched : testing::Test {
  TreeWatch watch(const std::vector<RecordRule>& rules) {
    return TreeWatch(kNodes, {"", rules, recorder, [this](const TreeTransition& transition) {
                                transitions.push_back(transition);
                              }});
  }
  static RecordRule rule(const std::string& path) { return {path, {}}; }

  std::shared_ptr<test::MemoryRecorder> recorder = std::make_shared<test::MemoryRecorder>();
  std::vector<TreeTransition> transitions;
};

using TreeWatching = Watched;

TEST_F(TreeWatching, callsNodesByTheNamesFromTheRoot) {
  EXPECT_EQ(watch({}).paths(),
            (std::vector<std::string>{"collect", "collect/Retry", "collect/Retry/pick up",
                                      "collect/place", "collect/place#2"}));
}

TEST_F(TreeWatching, choosesByGlobAndByRegularExpression) {
  const auto chosen = [this](const std::string& pattern) {
    TreeWatch tree = watch({rule(pattern)});
    std::string found;
    for (std::size_t i = 0; i < kNodes.size(); ++i) {
      const std::size_t before = recorder->calls().size();
      tree.onTransition(i, "IDLE", "RUNNING");
      found += recorder->calls().size() > before ? std::to_string(i) : "";
    }
    return found;
  };
  EXPECT_EQ(chosen("**/pick up"), "2");
  EXPECT_EQ(chosen("collect/*"), "134");
  EXPECT_EQ(chosen("**"), "01234");
  EXPECT_EQ(chosen("collect/place#?"), "4");
  EXPECT_EQ(chosen("^.*(Retry|place)"), "13");
}

TEST_F(TreeWatching, recordsANodeByTheFirstRuleThatMatches) {
  TreeWatch tree = watch({{"**/pick*", {"first"}}, {"**", {"second"}}});
  tree.onTransition(kPick, "IDLE", "RUNNING");
  tree.onTransition(kPlace, "IDLE", "RUNNING");
  EXPECT_EQ(recorder->asked(0).name + " " + recorder->asked(1).name, "first second");
}

TEST_F(TreeWatching, refusesARuleThatMeansNothing) {
  try {
    watch({rule("pick up")});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(
        error.what(),
        "no node of tree 'collect' matches 'pick up'; there are\n  collect\n  collect/Retry"
        "\n  collect/Retry/pick up\n  collect/place\n  collect/place#2");
  }
  EXPECT_THROW(watch({rule("^(")}), std::invalid_argument);
}

TEST_F(TreeWatching, endsWithPatternsThatNeverWould) {
  const std::vector<WatchedNode> long_name = {{std::string(60'000, 'a') + "!", "Action", 1, {}}};
  const auto watchAll = [&](const std::string& path) {
    TreeWatch(long_name, {"", {rule(path)}, recorder, [](const TreeTransition&) {}});
  };
  EXPECT_NO_THROW(watchAll("^(a|b)*!"));
  EXPECT_THROW(watchAll("^(a+)+"), std::invalid_argument);
}

TEST_F(TreeWatching, recordsAttemptsAndHaltsOfTheChosenNode) {
  {
    TreeWatch tree = watch({rule("**/pick up")});
    tree.onTransition(kCollect, "IDLE", "RUNNING");
    for (const char* end : {"FAILURE", "SUCCESS"}) {
      tree.onTransition(kPick, "IDLE", "RUNNING");
      tree.onTransition(kPick, "RUNNING", end);
      tree.onTransition(kPick, end, "IDLE");
    }
    tree.onTransition(kPick, "IDLE", "FAILURE");  // within one tick
    tree.onTransition(kPick, "FAILURE", "IDLE");
    tree.onTransition(kCollect, "RUNNING", "IDLE");
    tree.onTransition(kCollect, "IDLE", "RUNNING");  // a new run
    tree.onTransition(kPick, "IDLE", "RUNNING");
    tree.onTransition(kPick, "RUNNING", "IDLE");
  }
  const std::string pick = " collect/Retry/pick up ";
  EXPECT_EQ(recorder->calls(8),
            (Calls{"start" + pick + "#1", "stop" + pick + "failure", "start" + pick + "#2",
                   "stop" + pick + "success", "start" + pick + "#1", "stop" + pick + "failure",
                   "start" + pick + "#1", "stop" + pick + "halted"}));
  EXPECT_EQ(recorder->asked(0).name, "pick up");
}

TEST_F(TreeWatching, publishesEveryTransitionWithTheRecordingItBelongsTo) {
  TreeWatch tree = watch({rule("collect"), rule("**/pick up")});
  tree.onTransition(kCollect, "IDLE", "RUNNING");
  tree.onTransition(kRetry, "IDLE", "RUNNING");
  tree.onTransition(kPick, "IDLE", "RUNNING");
  tree.onTransition(kPick, "RUNNING", "FAILURE");
  tree.onTransition(kPick, "FAILURE", "IDLE");
  ASSERT_EQ(transitions.size(), 5U);
  std::vector<std::int64_t> ids;
  std::vector<std::int32_t> attempts;
  for (const TreeTransition& transition : transitions) {
    ids.push_back(transition.behavior_id);
    attempts.push_back(transition.attempt);
    EXPECT_EQ(transition.tree, "collect");
    EXPECT_GE(transition.duration, 0.0);
  }
  EXPECT_EQ(ids, (std::vector<std::int64_t>{1, 1, 2, 2, 1}));
  EXPECT_EQ(attempts, (std::vector<std::int32_t>{1, 1, 1, 1, 2}));
  EXPECT_EQ(transitions[3].path, "collect/Retry/pick up");
  EXPECT_EQ(transitions[3].type, "Action");
  EXPECT_EQ(transitions[3].uid, 3U);
  EXPECT_EQ(transitions[3].from_status + ">" + transitions[3].to_status, "RUNNING>FAILURE");
}

}  // namespace
}  // namespace afterglow::nodes::tree_watch_test
