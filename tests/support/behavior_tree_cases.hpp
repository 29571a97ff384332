/// \file
/// The test cases of <RecordBehavior> and TreeObserver, for the version of BehaviorTree.CPP whose
/// adapter was included before; that file also says how its version is spoken: test::document,
/// test::modelId, test::tickOnce.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/memory_recorder.hpp"
#include "tests/support/paper_trees.hpp"

namespace afterglow::nodes {

using test::Calls;
using Status = BT::NodeStatus;

/// What the leaves of a tree do, and what they did.
struct World {
  std::map<std::string, std::deque<Status>> results;  ///< tick by tick; then SUCCESS
  std::string throwing;                               ///< this one throws
  Calls ticked;
};

class Leaf : public BT::StatefulActionNode {
 public:
  Leaf(const std::string& name, const BT::NodeConfiguration& config, World& world)
      : BT::StatefulActionNode(name, config), world_(world) {}
  static BT::PortsList providedPorts() {
    return {BT::InputPort<std::string>("what"), BT::InputPort<double>("distance"),
            BT::BidirectionalPort<std::string>("object")};
  }
  Status onStart() override { return step(); }
  Status onRunning() override { return step(); }
  void onHalted() override { world_.ticked.push_back("halt " + name()); }

 private:
  Status step() {
    world_.ticked.push_back(name());
    if (name() == world_.throwing) throw std::runtime_error(name() + " broke");
    std::deque<Status>& results = world_.results[name()];
    if (results.empty()) return Status::SUCCESS;
    const Status result = results.front();
    results.pop_front();
    return result;
  }
  World& world_;
};

struct BehaviorTrees : testing::Test {
  BehaviorTrees() {
    registerRecordBehavior(factory, recorder);
    // Trees written before 3.7 spell it so.
    factory.registerNodeType<BT::RetryNode>("RetryUntilSuccesful");
    for (const std::string& leaf : test::paperLeaves()) addLeaf(leaf);
    for (const char* leaf : {"reach", "grasp"}) addLeaf(leaf);
  }
  void addLeaf(const std::string& leaf) {
    factory.registerBuilder<Leaf>(
        test::modelId(leaf), [this](const std::string& name, const BT::NodeConfiguration& config) {
          return std::make_unique<Leaf>(name, config, world);
        });
  }
  BT::Tree tree(const std::string& content) {
    return trees("<BehaviorTree ID=\"MainTree\">" + content + "</BehaviorTree>");
  }
  BT::Tree trees(const std::string& elements) {
    return factory.createTreeFromText(test::document(elements));
  }
  /// Ticks on while recordings are being started, and while leaves run.
  static Status tickToEnd(BT::Tree& tree) {
    Status status = test::tickOnce(tree);
    while (status == Status::RUNNING) {
      std::this_thread::yield();
      status = test::tickOnce(tree);
    }
    return status;
  }
  void tickUntilTicked(BT::Tree& tree, std::size_t count) const {
    while (world.ticked.size() < count) {
      ASSERT_EQ(test::tickOnce(tree), Status::RUNNING);
      std::this_thread::yield();
    }
  }

  std::shared_ptr<test::MemoryRecorder> recorder = std::make_shared<test::MemoryRecorder>();
  World world;
  BT::BehaviorTreeFactory factory;
};

using RecordBehaviorDecorator = BehaviorTrees;
using ObservedTree = BehaviorTrees;

TEST_F(RecordBehaviorDecorator, asksForWhatItsPortsSay) {
  BT::Tree asked = tree(
      R"(<RecordBehavior name="pick up" topics="/a, /b;/c /d" regexes="/arm/.{1,3} /leg"
           exclude="/arm/x" limits="/a max_hz=2; /b every=5" tags="demo lab" all="true"
           parameters='{"object": "gearbox bottom"}' pre_roll="1.5" keep_if="failure,halted"
           attempt="4" timeout="7.5"><Action ID="reach"/></RecordBehavior>)");
  EXPECT_EQ(tickToEnd(asked), Status::SUCCESS);
  EXPECT_EQ(recorder->calls(2), (Calls{"start pick up #4", "stop pick up success"}));
  const RecordingOptions options = recorder->asked(0);
  using Words = std::vector<std::string>;
  EXPECT_EQ(options.name, "pick up");
  EXPECT_EQ(options.topics, (Words{"/a", "/b", "/c", "/d"}));
  EXPECT_EQ(options.regexes, (Words{"/arm/.{1,3}", "/leg"}));
  EXPECT_EQ(options.exclude, (Words{"/arm/x"}));
  EXPECT_EQ(options.limits, (Words{"/a max_hz=2", "/b every=5"}));
  EXPECT_EQ(options.tags, (Words{"demo", "lab"}));
  EXPECT_TRUE(options.all);
  EXPECT_EQ(options.parameters, R"({"object": "gearbox bottom"})");
  EXPECT_EQ(options.pre_roll_s, 1.5);
  EXPECT_EQ(options.keep_if, "failure,halted");
  EXPECT_EQ(options.timeout_s, 7.5);
}

TEST_F(RecordBehaviorDecorator, isCalledAsItsChildAndReadsTheBlackboard) {
  BT::Tree asked = tree(
      R"(<RecordBehavior topics="{topics}" parameters="{parameters}"><Action ID="reach"/>
         </RecordBehavior>)");
  asked.rootBlackboard()->set("topics", std::string("/a /b"));
  asked.rootBlackboard()->set("parameters", std::string(R"({"arm": "left"})"));
  EXPECT_EQ(tickToEnd(asked), Status::SUCCESS);
  EXPECT_EQ(recorder->asked(0).name, "reach");
  EXPECT_EQ(recorder->asked(0).topics.size(), 2U);
  EXPECT_EQ(recorder->asked(0).parameters, R"({"arm": "left"})");
  BT::Tree wrong = tree(
      R"(<RecordBehavior name="pick" topics="{nothing there}"><Action ID="reach"/>
         </RecordBehavior>)");
  try {
    test::tickOnce(wrong);
    FAIL();
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("RecordBehavior 'pick'"), std::string::npos);
  }
}

TEST_F(RecordBehaviorDecorator, letsTheChildBeginWhenTheRecordingStandsWithoutBlocking) {
  recorder->setOpen(false);
  BT::Tree waiting =
      tree(R"(<RecordBehavior name="pick" topics="/a"><Action ID="reach"/></RecordBehavior>)");
  EXPECT_EQ(test::tickOnce(waiting), Status::RUNNING);
  EXPECT_EQ(test::tickOnce(waiting), Status::RUNNING);
  EXPECT_EQ(world.ticked, Calls{});
  recorder->setOpen(true);
  EXPECT_EQ(tickToEnd(waiting), Status::SUCCESS);
  EXPECT_EQ(world.ticked, Calls{"reach"});
  EXPECT_EQ(recorder->calls(2), (Calls{"start pick #1", "stop pick success"}));
}

TEST_F(RecordBehaviorDecorator, goesOnWithoutWaitingOrWithoutRecorderIfItMay) {
  recorder->setOpen(false);
  BT::Tree eager = tree(
      R"(<RecordBehavior name="pick" wait="false" timeout="0.001"><Action ID="reach"/>
         </RecordBehavior>)");
  EXPECT_EQ(test::tickOnce(eager), Status::SUCCESS);
  BT::Tree patient =
      tree(R"(<RecordBehavior name="pick" timeout="0.001"><Action ID="reach"/></RecordBehavior>)");
  EXPECT_EQ(tickToEnd(patient), Status::SUCCESS);
  recorder->setOpen(true);
  recorder->calls(2);
  recorder->leave();
  BT::Tree alone = tree(R"(<RecordBehavior name="pick"><Action ID="reach"/></RecordBehavior>)");
  EXPECT_EQ(tickToEnd(alone), Status::SUCCESS);
  BT::Tree strict =
      tree(R"(<RecordBehavior name="pick" required="true"><Action ID="reach"/></RecordBehavior>)");
  EXPECT_EQ(tickToEnd(strict), Status::FAILURE);
  EXPECT_EQ(world.ticked.size(), 3U);
}

TEST_F(RecordBehaviorDecorator, recordsEveryRunAndEndsEachOnce) {
  BT::Tree again = tree(R"(<RecordBehavior name="pick"><Action ID="reach"/></RecordBehavior>)");
  world.results["reach"] = {Status::RUNNING, Status::SUCCESS, Status::FAILURE, Status::SUCCESS};
  EXPECT_EQ(tickToEnd(again), Status::SUCCESS);
  EXPECT_EQ(tickToEnd(again), Status::FAILURE);
  EXPECT_EQ(tickToEnd(again), Status::SUCCESS);
  again.haltTree();
  EXPECT_EQ(recorder->calls(6), (Calls{"start pick #1", "stop pick success", "start pick #1",
                                       "stop pick failure", "start pick #2", "stop pick success"}));
}

TEST_F(RecordBehaviorDecorator, endsAsHaltedAfterItsChildIsHalted) {
  BT::Tree halted = tree(R"(<RecordBehavior name="pick"><Action ID="reach"/></RecordBehavior>)");
  world.results["reach"] = {Status::RUNNING, Status::RUNNING};
  tickUntilTicked(halted, 2);
  halted.haltTree();
  halted.haltTree();
  EXPECT_EQ(world.ticked, (Calls{"reach", "reach", "halt reach"}));
  EXPECT_EQ(recorder->calls(2), (Calls{"start pick #1", "stop pick halted"}));
  EXPECT_EQ(tickToEnd(halted), Status::SUCCESS);
  EXPECT_EQ(recorder->calls(4).size(), 4U);
}

TEST_F(RecordBehaviorDecorator, haltsItsChildWhereAParentHaltsIt) {
  BT::Tree parallel = tree(test::parallel(
      R"(<RecordBehavior name="pick"><Action ID="reach"/></RecordBehavior><Action ID="grasp"/>)"));
  world.results["reach"] = world.results["grasp"] = std::deque<Status>(1000000, Status::RUNNING);
  while (std::count(world.ticked.begin(), world.ticked.end(), "reach") == 0) {
    test::tickOnce(parallel);
  }
  world.results["grasp"] = {Status::FAILURE};
  EXPECT_EQ(test::tickOnce(parallel), Status::FAILURE);
  EXPECT_EQ(world.ticked.back(), "halt reach");
  EXPECT_EQ(recorder->calls(2), (Calls{"start pick #1", "stop pick halted"}));
}

TEST_F(RecordBehaviorDecorator, isHaltedBeforeItsChildEverBegan) {
  recorder->setOpen(false);
  BT::Tree early = tree(R"(<RecordBehavior name="pick"><Action ID="reach"/></RecordBehavior>)");
  EXPECT_EQ(test::tickOnce(early), Status::RUNNING);
  early.haltTree();
  recorder->setOpen(true);
  EXPECT_EQ(recorder->calls(2), (Calls{"start pick #1", "stop pick halted"}));
  EXPECT_EQ(world.ticked, Calls{});
}

TEST_F(RecordBehaviorDecorator, endsWithTheExceptionOfItsChildWhichGoesOn) {
  BT::Tree broken = tree(R"(<RecordBehavior name="pick"><Action ID="reach"/></RecordBehavior>)");
  world.throwing = "reach";
  try {
    tickToEnd(broken);
    FAIL();
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("reach broke"), std::string::npos);
  }
  EXPECT_EQ(recorder->calls(2), (Calls{"start pick #1", "stop pick exception"}));
  world.throwing.clear();
  EXPECT_EQ(tickToEnd(broken), Status::SUCCESS);
  EXPECT_EQ(recorder->calls(4).back(), "stop pick success");
}

TEST_F(RecordBehaviorDecorator, countsTheAttemptsOfARetry) {
  BT::Tree retried = tree(
      R"(<RecordBehavior name="kitting"><RetryUntilSuccessful num_attempts="3">
           <RecordBehavior name="pick"><Action ID="reach"/></RecordBehavior>
         </RetryUntilSuccessful></RecordBehavior>)");
  world.results["reach"] = {Status::FAILURE, Status::FAILURE, Status::FAILURE};
  EXPECT_EQ(tickToEnd(retried), Status::FAILURE);
  EXPECT_EQ(tickToEnd(retried), Status::SUCCESS);
  EXPECT_EQ(recorder->calls(12),
            (Calls{"start kitting #1", "start kitting/pick #1", "stop kitting/pick failure",
                   "start kitting/pick #2", "stop kitting/pick failure", "start kitting/pick #3",
                   "stop kitting/pick failure", "stop kitting failure", "start kitting #2",
                   "start kitting/pick #1", "stop kitting/pick success", "stop kitting success"}));
}

TEST_F(RecordBehaviorDecorator, recordsBranchesOfAParallelAtOnce) {
  BT::Tree parallel = tree(test::parallel(
      R"(<RecordBehavior name="a"><Action ID="reach"/></RecordBehavior>
         <RecordBehavior name="b"><Action ID="grasp"/></RecordBehavior>)"));
  world.results["reach"] = std::deque<Status>(1000000, Status::RUNNING);
  while (world.ticked.empty() || world.ticked.back() != "grasp") test::tickOnce(parallel);
  world.results.clear();
  EXPECT_EQ(tickToEnd(parallel), Status::SUCCESS);
  const Calls calls = recorder->calls(4);
  EXPECT_EQ(calls[0] + ", " + calls[1], "start a #1, start b #1");
}

TEST_F(ObservedTree, recordsChosenNodesOfAnUnmodifiedTree) {
  BT::Tree paper = trees(test::paperTrees());
  std::vector<TreeTransition> transitions;
  TreeWatchOptions options;
  options.recorder = recorder;
  options.publish = [&](const TreeTransition& transition) { transitions.push_back(transition); };
  options.record = {{"collect a gearbox bottom"}, {"**/pick"}, {"**/say#?", {"voice"}}};
  {
    const TreeObserver observer(paper, options);
    // The first grasp slips: "pick" fails, and the retry detects and picks again.
    world.results["close gripper"] = {Status::FAILURE};
    EXPECT_EQ(tickToEnd(paper), Status::SUCCESS);
  }
  const std::string all = "collect a gearbox bottom ";
  const std::string pick =
      "collect a gearbox bottom/go pick gearbox bottom/Fallback/Sequence/RetryUntilSuccesful/"
      "Sequence/pick";
  const std::string say = pick + "/Sequence/say#2 ";
  EXPECT_EQ(recorder->calls(10),
            (Calls{"start " + all + "#1", "start " + pick + " #1", "start " + say + "#1",
                   "stop " + say + "success", "stop " + pick + " failure", "start " + pick + " #2",
                   "start " + say + "#1", "stop " + say + "success", "stop " + pick + " success",
                   "stop " + all + "success"}));
  EXPECT_EQ(recorder->asked(2).name, "voice");
  std::map<std::string, int> beginnings;
  for (const TreeTransition& transition : transitions) {
    beginnings[transition.path] += transition.from_status == "IDLE";
    EXPECT_EQ(transition.tree, "collect a gearbox bottom");
    if (transition.path == pick + "/Sequence/open gripper") {
      EXPECT_TRUE(transition.behavior_id == 2 || transition.behavior_id == 4);
    }
  }
  EXPECT_EQ(beginnings[pick], 2);
  EXPECT_EQ(beginnings["collect a gearbox bottom/tilt projector for navigation"], 1);
}

TEST_F(ObservedTree, endsAHaltedNodeAndBranchesOfAParallel) {
  BT::Tree parallel = tree(test::parallel(R"(<Action ID="reach"/><Action ID="grasp"/>)"));
  TreeWatchOptions options;
  options.recorder = recorder;
  options.publish = [](const TreeTransition&) {};
  options.record = {{"*/*", {}}};
  const TreeObserver observer(parallel, options);
  world.results["reach"] = {Status::RUNNING, Status::RUNNING, Status::RUNNING};
  world.results["grasp"] = {Status::RUNNING, Status::SUCCESS};
  EXPECT_EQ(test::tickOnce(parallel), Status::RUNNING);
  EXPECT_EQ(test::tickOnce(parallel), Status::RUNNING);
  parallel.haltTree();
  Calls calls = recorder->calls(4);
  std::sort(calls.begin(), calls.end());  // the ends are not in each other's way
  EXPECT_EQ(calls, (Calls{"start Parallel/grasp #1", "start Parallel/reach #1",
                          "stop Parallel/grasp success", "stop Parallel/reach halted"}));
}

TEST_F(ObservedTree, refusesARuleThatNoNodeMatches) {
  BT::Tree paper = trees(test::paperTrees());
  TreeWatchOptions options;
  options.recorder = recorder;
  options.publish = [](const TreeTransition&) {};
  options.record = {{"**/pcik", {}}};
  EXPECT_THROW(TreeObserver(paper, options), std::invalid_argument);
}

}  // namespace afterglow::nodes
