// A recorder's writes reach a server that is slow, away, killed: all of them, once.
#include "replay/store/mongo/spooled_store.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "replay/store/open/open_store.hpp"
#include "tests/support/mongo_server.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::spooled_store_test {
namespace {

using namespace std::chrono_literals;
using test::endBehavior;
using test::sampleBehavior;
using test::stringChannel;
using test::stringMessage;

class SpooledStoreTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto why = test::MongoServer::absence()) GTEST_SKIP() << *why;
    server.emplace();
    if (!server->isOwn()) GTEST_SKIP() << "the server is not this test's to stop";
    uri = server->uri("serverSelectionTimeoutMS=500&socketTimeoutMS=500&connectTimeoutMS=500");
    open();
  }

  void open(std::chrono::milliseconds farewell = 2s) {
    store.reset();
    store = std::make_unique<SpooledStore>(
        uri, SpoolOptions{folder.path("spool.db"), 1'000'000, farewell, 10ms});
  }

  std::int64_t begin() {
    const std::int64_t recording = store->addRecording({0, "", "test", "fetch7"});
    channel = store->addChannel(recording, stringChannel("/a"));
    Behavior behavior = sampleBehavior(recording, {"/a"}, 0, 0);
    behavior.end.reset();
    return store->addBehavior(behavior);
  }
  /// Messages [from, to), one a batch.
  void append(int from, int to) {
    for (int i = from; i < to; ++i) {
      store->append({stringMessage(channel, i, static_cast<std::uint64_t>(i), std::to_string(i))});
    }
  }
  bool isSent() const {
    const auto end = std::chrono::steady_clock::now() + 30s;
    while (store->spoolStatus()->unsent_bytes > 0) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(2ms);
    }
    return true;
  }
  /// What the server has of the one behavior, read by another store.
  std::vector<std::string> arrived() const {
    const auto reader = openStore(uri, OpenMode::ReadOnly);
    const auto behaviors = reader->behaviors({});
    EXPECT_EQ(behaviors.size(), 1u);
    EXPECT_EQ(reader->recordings().size(), 1u);
    return behaviors.empty() ? std::vector<std::string>{}
                             : test::readTexts(*reader, behaviors.front());
  }
  static std::vector<std::string> numbers(int count) {
    std::vector<std::string> texts;
    for (int i = 0; i < count; ++i) texts.push_back(std::to_string(i));
    return texts;
  }

  test::TempFolder folder;
  std::optional<test::MongoServer> server;
  std::string uri;
  std::unique_ptr<SpooledStore> store;
  std::int64_t channel = 0;
};

TEST_F(SpooledStoreTest, everythingArrives) {
  const std::int64_t id = begin();
  append(0, 10);
  store->addFile(std::string(64, 'a'), {1, 2, 3});
  endBehavior(*store, id, Stamp{9}, "success");
  ASSERT_TRUE(isSent());
  EXPECT_EQ(arrived(), numbers(9));
  const auto reader = openStore(uri, OpenMode::ReadOnly);
  EXPECT_EQ(reader->behavior(id)->outcome, "success") << "the id is the same on the server";
  EXPECT_EQ(reader->file(std::string(64, 'a')), (Bytes{1, 2, 3}));
  EXPECT_EQ(reader->recordings().front().robot, "fetch7");
  store->removeBehavior(id);
  ASSERT_TRUE(isSent());
  EXPECT_TRUE(reader->behaviors({}).empty());
}

TEST_F(SpooledStoreTest, aServerKilledAndRestartedLosesNothingAndDoublesNothing) {
  const std::int64_t id = begin();
  append(0, 100);
  server->kill();
  append(100, 200);
  server->start();
  append(200, 300);
  endBehavior(*store, id, Stamp{300}, "success");
  ASSERT_TRUE(isSent());
  EXPECT_EQ(arrived(), numbers(300));
}

TEST_F(SpooledStoreTest, aServerThatStallsHoldsUpNothing) {
  const std::int64_t id = begin();
  append(0, 20);
  server->pause();
  append(20, 40);
  endBehavior(*store, id, Stamp{40}, "success");
  const auto error_deadline = std::chrono::steady_clock::now() + 20s;
  while (store->spoolStatus()->last_error.empty() &&
         std::chrono::steady_clock::now() < error_deadline) {
    std::this_thread::sleep_for(2ms);
  }
  EXPECT_NE(store->spoolStatus()->last_error, "");
  server->resume();
  ASSERT_TRUE(isSent());
  EXPECT_EQ(arrived(), numbers(40));
  EXPECT_EQ(store->spoolStatus()->last_error, "");
}

TEST_F(SpooledStoreTest, aServerThatIsAwayAtTheStartGetsEverythingLater) {
  store.reset();
  server->kill();
  open(0ms);
  const std::int64_t id = begin();
  append(0, 10);
  endBehavior(*store, id, Stamp{10}, "success");
  EXPECT_EQ(store->spoolStatus()->unsent_messages, 10u);
  open(0ms);  // another recorder's run, and the server is still away
  EXPECT_EQ(store->spoolStatus()->unsent_messages, 10u);
  EXPECT_EQ(store->behavior(id)->outcome, "success");
  server->start();
  ASSERT_TRUE(isSent());
  EXPECT_EQ(arrived(), numbers(10));
  EXPECT_TRUE(openStore(uri, OpenMode::ReadOnly)->behavior(id));
}

TEST_F(SpooledStoreTest, idsThatTheServerNeverGaveCannotMeetItsOwn) {
  store.reset();
  server->kill();
  uri = uri.substr(0, uri.find('?')) + "_other?serverSelectionTimeoutMS=100";
  store =
      std::make_unique<SpooledStore>(uri, SpoolOptions{folder.path("other.db"), 1000, 0ms, 10ms});
  EXPECT_GE(begin(), std::int64_t{1} << 40);
}

TEST_F(SpooledStoreTest, aBehaviorWhoseRecorderDiedIsIncomplete) {
  begin();
  append(0, 5);
  open();
  ASSERT_TRUE(isSent());
  EXPECT_EQ(arrived(), numbers(5));
  const Behavior behavior = openStore(uri, OpenMode::ReadOnly)->behaviors({}).front();
  EXPECT_EQ(behavior.outcome, kIncomplete);
  EXPECT_EQ(behavior.end, Stamp{5});
}

TEST_F(SpooledStoreTest, aFullSpoolIsAnError) {
  open(0ms);
  begin();
  server->kill();
  const auto fill = [&] {
    store->append({stringMessage(channel, 0, 0, std::string(600'000, 'x'))});
    store->append({stringMessage(channel, 1, 1, std::string(600'000, 'x'))});
  };
  try {
    fill();
    FAIL() << "no error";
  } catch (const StoreError& error) {
    EXPECT_NE(std::string(error.what()).find("the spool is full"), std::string::npos);
  }
  EXPECT_EQ(store->spoolStatus()->unsent_messages, 1u) << "what was stored stays";
}

TEST_F(SpooledStoreTest, whatATransactionThrewOutIsNotSent) {
  begin();
  append(0, 2);
  const auto fail = [&] {
    store->transaction([&] {
      append(2, 3);
      throw std::runtime_error("enough");
    });
  };
  EXPECT_THROW(fail(), std::runtime_error);
  ASSERT_TRUE(isSent());
  EXPECT_EQ(arrived(), numbers(2));
}

/// The server of these tests makes SQL of names and takes no quotes in them.
TEST_F(SpooledStoreTest, whatTheServerRefusesHoldsUpNothing) {
  const std::int64_t id = begin();
  const auto quoted = store->addChannel(store->behavior(id)->recording, stringChannel("/it's"));
  append(0, 2);
  store->append({stringMessage(quoted, 2, 2, "quoted"), stringMessage(channel, 3, 3, "2")});
  store->append({stringMessage(channel, 4, 4, "3")});
  endBehavior(*store, id, Stamp{5}, "success");
  ASSERT_TRUE(isSent());
  EXPECT_EQ(arrived(), numbers(4));
  const SpoolStatus status = *store->sendRest();
  EXPECT_EQ(status.refused_messages, 1u);
  EXPECT_EQ(status.last_refusal.rfind("1 message on /it's: mongodb://", 0), 0u)
      << status.last_refusal;
  EXPECT_NE(status.last_refusal.find("takes no quotes"), std::string::npos) << status.last_refusal;
  EXPECT_EQ(status.path, folder.path("spool.db"));
  open();
  ASSERT_TRUE(isSent());
  EXPECT_EQ(store->spoolStatus()->refused_messages, 1u) << "it was tried again, and is not lost";
}

TEST_F(SpooledStoreTest, theEndTellsWhatWaits) {
  open(10ms);
  begin();
  ASSERT_TRUE(isSent());
  server->kill();
  append(0, 3);
  const SpoolStatus status = *store->sendRest();
  EXPECT_EQ(status.unsent_messages, 3u);
  EXPECT_EQ(status.path, folder.path("spool.db"));
}

TEST_F(SpooledStoreTest, oneRecorderAtATimeHasASpool) {
  EXPECT_THROW(SpooledStore(uri, SpoolOptions{folder.path("spool.db")}), StoreError);
}

}  // namespace
}  // namespace afterglow::replay::spooled_store_test
