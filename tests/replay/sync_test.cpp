// Behaviors on their way from store to store.
#include "replay/store/sync.hpp"

#include <gtest/gtest.h>

#include "replay/store/open/open_store.hpp"
#include "replay/store/store_import.hpp"
#include "tests/support/faulty_store.hpp"
#include "tests/support/mongo_server.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::sync_test {
namespace {

using test::sampleBehavior;
using test::stringChannel;
using test::stringMessage;
using Texts = std::vector<std::string>;

/// A robot's store: a pick with a child, messages, context and a file.
struct Robot {
  Robot() {
    const std::int64_t recording = store->addRecording({0, "", "recorder", "fetch7"});
    const std::int64_t a = store->addChannel(recording, stringChannel("/a"));
    const std::int64_t tf = store->addChannel(recording, stringChannel("/tf", "/broadcaster"));
    store->append({stringMessage(a, 10, 1, "a"), stringMessage(tf, 11, 2, "tf"),
                   stringMessage(a, 12, 3, "b"), stringMessage(a, 30, 4, "outside")});
    store->addFile(sum, {1, 2, 3});
    Behavior pick = sampleBehavior(recording, {"/a"}, 10, 20);
    pick.outcome = "success";
    pick.snapshot = R"({"files": {"file:///x.wav": ")" + sum + R"("}})";
    pick.id = store->addBehavior(pick);
    Behavior reach = sampleBehavior(recording, {"/a"}, 11, 13);
    reach.name = "reach";
    reach.outcome = "success";
    reach.parent = pick.id;
    store->addBehavior(reach);
    Behavior running = sampleBehavior(recording, {"/a"}, 14, 0);
    running.name = "running";
    running.end.reset();
    store->addBehavior(running);
  }
  const std::string sum = std::string(64, 'a');
  std::unique_ptr<Store> store = openMemoryStore();
};

void expectPick(const Store& fleet, const std::string& sum) {
  BehaviorFilter picks;
  picks.name = "pick";
  const auto found = fleet.behaviors(picks);
  ASSERT_EQ(found.size(), 1u);
  MessageRange all;
  all.with_all_topics = true;
  EXPECT_EQ(test::readTexts(fleet, found[0], all), (Texts{"a", "tf", "b"}));
  EXPECT_EQ(fleet.file(sum), (Bytes{1, 2, 3}));
  picks.name = "reach";
  ASSERT_EQ(fleet.behaviors(picks).size(), 1u);
  EXPECT_EQ(fleet.behaviors(picks)[0].parent, found[0].id);
  ASSERT_EQ(fleet.recordings().size(), 1u);
  EXPECT_EQ(fleet.recordings()[0].robot, "fetch7");
}

TEST(Sync, copiesBehaviorsWithAllThatBelongsToThemOnce) {
  const Robot robot;
  const auto fleet = openMemoryStore();
  for (int round = 0; round < 2; ++round) {
    const SyncReport report = syncBehaviors(*robot.store, *fleet, {});
    EXPECT_EQ(report.copied, round == 0 ? 2u : 0u);
    EXPECT_EQ(report.present, round == 0 ? 0u : 2u);
    EXPECT_EQ(report.open, 1u);
    expectPick(*fleet, robot.sum);
  }
}

/// As a recorder keeps them: what a camera saw just before the begin is placed by them.
TEST(Sync, copiesTheTransformsBeforeABehaviorToo) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const auto robot = openMemoryStore();
  const std::int64_t recording = robot->addRecording({0, "", "recorder", "fetch7"});
  const std::int64_t a = robot->addChannel(recording, stringChannel("/a"));
  const std::int64_t tf = robot->addChannel(recording, stringChannel("/tf", "/broadcaster"));
  robot->append({stringMessage(tf, 9 * kSecond, 1, "of no use"),
                 stringMessage(tf, 12 * kSecond, 2, "earlier"),
                 stringMessage(a, 15 * kSecond, 3, "not its own"),
                 stringMessage(a, 20 * kSecond, 4, "first")});
  Behavior pick = sampleBehavior(recording, {"/a"}, 20 * kSecond, 30 * kSecond);
  pick.outcome = "success";
  robot->addBehavior(pick);
  const auto fleet = openMemoryStore();
  syncBehaviors(*robot, *fleet, {});
  Behavior all = fleet->behaviors({}).front();
  all.begin = {0};
  MessageRange range;
  range.with_all_topics = true;
  EXPECT_EQ(test::readTexts(*fleet, all, range), (Texts{"earlier", "first"}));
}

TEST(Sync, goesOnWhereItBrokeOff) {
  const Robot robot;
  test::FaultyStore fleet;
  std::size_t steps = 0;
  const auto break_off = [&](std::size_t, std::size_t, const SyncReport&) {
    if (++steps == 2) fleet.failWith("cable pulled");
  };
  EXPECT_THROW(syncBehaviors(*robot.store, fleet, {}, break_off), StoreError);
  EXPECT_TRUE(fleet.behaviors({}).empty()) << "a behavior comes after its messages";
  fleet.failWith("");
  syncBehaviors(*robot.store, fleet, {});
  expectPick(fleet, robot.sum);
}

TEST(Sync, completesAParentThatComesLater) {
  const Robot robot;
  const auto fleet = openMemoryStore();
  BehaviorFilter children;
  children.name = "reach";
  syncBehaviors(*robot.store, *fleet, children);
  EXPECT_EQ(fleet->behaviors(children)[0].parent, 0);
  EXPECT_EQ(syncBehaviors(*robot.store, *fleet, {}).completed, 1u);
  expectPick(*fleet, robot.sum);
}

TEST(Sync, completesABehaviorThatHadNoEndThere) {
  const Robot robot;
  BehaviorFilter picks;
  picks.name = "pick";
  Behavior unended = robot.store->behaviors(picks).at(0);
  const auto fleet = openMemoryStore();
  unended.recording = fleet->addRecording(robot.store->recordings().at(0));
  unended.end.reset();
  unended.outcome.clear();
  unended.snapshot = "{}";
  fleet->addBehavior(unended);
  const SyncReport report = syncBehaviors(*robot.store, *fleet, picks);
  EXPECT_EQ(report.completed, 1u);
  EXPECT_EQ(report.copied, 0u);
  const Behavior completed = fleet->behaviors(picks).at(0);
  EXPECT_EQ(completed.end, Stamp{20});
  EXPECT_EQ(completed.outcome, "success");
  EXPECT_NE(completed.snapshot.find(robot.sum), std::string::npos);
  EXPECT_EQ(test::readTexts(*fleet, completed), (Texts{"a", "b"}));
  EXPECT_EQ(fleet->file(robot.sum), (Bytes{1, 2, 3}));
}

TEST(Sync, endsABehaviorThatLacksItsEndBehindItsLastMessage) {
  const auto robot = openMemoryStore(), fleet = openMemoryStore();
  const std::int64_t recording = robot->addRecording({0, "", "recorder", "fetch7"});
  const std::int64_t a = robot->addChannel(recording, stringChannel("/a"));
  robot->append({stringMessage(a, 10, 1, "a"), stringMessage(a, 12, 2, "b")});
  Behavior died = sampleBehavior(recording, {"/a"}, 10, 0);
  died.end.reset();
  died.outcome = kIncomplete;
  robot->addBehavior(died);
  EXPECT_EQ(syncBehaviors(*robot, *fleet, {}).copied, 1u);
  EXPECT_EQ(fleet->behaviors({}).at(0).end, Stamp{13});
}

TEST(Sync, sendsTheMessagesThatAreMissingThere) {
  const Robot robot;
  const auto fleet = openMemoryStore();
  BehaviorFilter picks;
  picks.name = "pick";
  syncBehaviors(*robot.store, *fleet, picks);
  const Behavior pick = robot.store->behaviors(picks).at(0);
  robot.store->append({stringMessage(1, 15, 5, "late")});
  SyncTerms terms;
  EXPECT_EQ(syncBehaviors(*robot.store, *fleet, {pick}, terms).present, 1u);
  terms.is_sending = true;
  EXPECT_EQ(syncBehaviors(*robot.store, *fleet, {pick}, terms).completed, 1u);
  EXPECT_EQ(test::readTexts(*fleet, fleet->behaviors(picks).at(0)), (Texts{"a", "b", "late"}));
}

TEST(Sync, copiesTheFilesThatASnapshotNamesAndAreThere) {
  const auto copied = [](const std::string& snapshot) {
    const Robot robot;
    const auto fleet = openMemoryStore();
    BehaviorFilter picks;
    picks.name = "pick";
    Behavior pick = robot.store->behaviors(picks).at(0);
    pick.snapshot = snapshot;
    robot.store->updateBehavior(pick);
    return syncBehaviors(*robot.store, *fleet, picks).files;
  };
  const std::string there(64, 'a'), missing(64, 'b');
  EXPECT_EQ(copied(R"({"urdf": ")" + there + R"("})"), 1u);
  EXPECT_EQ(copied(R"({"urdf": ")" + missing + R"("})"), 0u);
  EXPECT_EQ(copied(R"({"urdf": 7, "files": {"x": null, "y": ")" + there + R"("}})"), 1u);
  EXPECT_EQ(copied(R"({"files": 5})"), 0u);
  EXPECT_EQ(copied("{}"), 0u);
}

/// Who sends asks again; a message that is refused for itself is left out.
TEST(Sync, leavesOutNothingForAStoreThatIsBusyOrAway) {
  const Robot robot;
  BehaviorFilter picks;
  picks.name = "pick";
  const std::vector<Behavior> pick = robot.store->behaviors(picks);
  SyncTerms terms;
  terms.is_sending = terms.leaves_out_refused = true;
  test::FaultyStore fleet;
  fleet.keepBusy(true);
  EXPECT_THROW(syncBehaviors(*robot.store, fleet, pick, terms), StoreBusy);
  fleet.keepBusy(false);
  fleet.refuseLargerThan(5);
  robot.store->append({stringMessage(1, 13, 5, "larger")});
  SyncReport report = syncBehaviors(*robot.store, fleet, pick, terms);
  EXPECT_EQ(report.refused, 2u);
  EXPECT_EQ(report.last_refusal, "a message on /a: too large");
  EXPECT_EQ(test::readTexts(fleet, fleet.behaviors(picks).at(0)), (Texts{"a", "b"}));
}

TEST(Sync, tellsHowManyMessagesAreThereBatchByBatch) {
  const auto robot = openMemoryStore(), fleet = openMemoryStore();
  const std::int64_t recording = robot->addRecording({0, "", "recorder", "fetch7"});
  const std::int64_t a = robot->addChannel(recording, stringChannel("/a"));
  std::vector<Message> many;
  for (std::uint64_t i = 0; i < 5001; ++i) many.push_back(stringMessage(a, 10, i, "x"));
  robot->append(many);
  robot->addBehavior(sampleBehavior(recording, {"/a"}, 10, 20));
  std::vector<std::uint64_t> told;
  syncBehaviors(*robot, *fleet, {}, [&](std::size_t, std::size_t, const SyncReport& report) {
    if (told.empty() || told.back() != report.messages) told.push_back(report.messages);
  });
  EXPECT_EQ(told, (std::vector<std::uint64_t>{0, 5000, 5001}));
}

TEST(StoreImport, leavesToOthersWhatItCannotDrop) {
  test::FaultyStore store;
  {
    StoreImport import(store, "a.bag");
    store.failWith("the disk is gone");
  }
  store.failWith("");
  EXPECT_EQ(store.recordings().size(), 1u);
  { const StoreImport import(store, "b.bag"); }
  EXPECT_EQ(store.recordings().size(), 1u) << "one that can be dropped is";
}

TEST(Sync, saysWhichRecordingIsMissing) {
  const Robot robot;
  const auto fleet = openMemoryStore();
  Behavior lost = sampleBehavior(77, {"/a"}, 10, 20);
  lost.key = newKey();
  try {
    syncBehaviors(*robot.store, *fleet, {lost}, {});
    FAIL() << "copied";
  } catch (const StoreError& error) {
    EXPECT_STREQ(error.what(), "recording 77 is missing in the store");
  }
  EXPECT_TRUE(fleet->behaviors({}).empty());
}

TEST(Sync, goesToAServerAndBack) {
  if (const auto why = test::MongoServer::absence()) GTEST_SKIP() << *why;
  const test::MongoServer server;
  const Robot robot;
  const auto fleet = openStore(server.uri(), OpenMode::ReadWrite);
  syncBehaviors(*robot.store, *fleet, {});
  expectPick(*fleet, robot.sum);
  const auto other_robot = openMemoryStore();
  syncBehaviors(*fleet, *other_robot, {});
  expectPick(*other_robot, robot.sum);
}

}  // namespace
}  // namespace afterglow::replay::sync_test
