// What every store must do: the same tests on SQLite and on MongoDB.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>

#include "replay/query/filter.hpp"
#include "replay/store/behavior_edit.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "replay/store/store_reading.hpp"
#include "tests/support/mongo_server.hpp"
#include "tests/support/query_cases.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::store_suite_test {
namespace {

using test::endBehavior;
using test::sampleBehavior;
using test::stringChannel;
using test::stringMessage;

/// One server for the program.
test::MongoServer& server() {
  static test::MongoServer instance;
  return instance;
}

class StoreSuite : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (GetParam() == std::string("SQLite")) {
      uri = folder.path("store.db");
    } else if (const auto why = test::MongoServer::absence()) {
      GTEST_SKIP() << *why;
    } else {
      uri = server().uri();
    }
    store = openStore(uri, OpenMode::ReadWrite);
    recording = store->addRecording({0, "", "test", "fetch7"});
  }

  std::int64_t channel(const std::string& topic) {
    return store->addChannel(recording, stringChannel(topic));
  }
  Message message(const std::string& topic, std::int64_t received_ns, std::uint64_t sequence,
                  const std::string& text) {
    return stringMessage(channel(topic), received_ns, sequence, text);
  }
  std::vector<std::string> texts(const MessageRange& range = {}, std::int64_t begin_ns = 0,
                                 std::int64_t end_ns = 1000) {
    return test::readTexts(*store, sampleBehavior(recording, {"/a"}, begin_ns, end_ns), range);
  }
  std::vector<std::string> names(const BehaviorFilter& filter) {
    std::vector<std::string> found;
    for (const Behavior& behavior : store->behaviors(filter)) found.push_back(behavior.name);
    return found;
  }
  /// The bytes of a message of this type after a way through the store.
  Bytes throughStore(const std::string& type, const std::string& definition, const Bytes& bytes) {
    const std::int64_t id =
        store->addChannel(recording, {"/x", type, std::string(32, '0'), definition, false, ""});
    store->append({{id, Stamp{5}, ++last_sequence, Stamp{3}, bytes}});
    MessageRange all;
    all.topics = {"/x"};
    const auto read = test::readAll(*store->messages(sampleBehavior(recording, {}, 0, 9), all));
    EXPECT_EQ(read.size(), last_sequence);
    EXPECT_EQ(read.back().header_stamp, Stamp{3});
    return read.back().bytes;
  }

  test::TempFolder folder;
  std::string uri;
  std::unique_ptr<Store> store;
  std::int64_t recording = 0;
  std::uint64_t last_sequence = 0;
};

using Texts = std::vector<std::string>;

TEST_P(StoreSuite, importsAreDroppedOrFinished) {
  const std::int64_t dropped = store->beginImport({0, "", "a.bag", ""});
  const std::int64_t finished = store->beginImport({0, "", "b.bag", ""});
  for (const std::int64_t id : {dropped, finished}) {
    const std::int64_t a = store->addChannel(id, stringChannel("/imported"));
    store->append({stringMessage(a, 1, 0, "x"), stringMessage(a, 2, 1, "y")});
  }
  EXPECT_EQ(store->dropUnfinished(), 0u) << "their program lives";
  EXPECT_EQ(openStore(uri, OpenMode::ReadWrite)->dropUnfinished(), 0u) << "and it can be told";
  store->dropRecording(dropped);
  store->transaction([&] {
    store->addBehavior(sampleBehavior(finished, {"/imported"}, 0, 10));
    store->finishImport(finished);
  });
  EXPECT_THROW(store->finishImport(finished), StoreError) << "once";
  EXPECT_THROW(store->finishImport(dropped), StoreError);
  EXPECT_THROW(store->dropRecording(finished), StoreError) << "it has a behavior";
  const auto all = store->recordings();
  EXPECT_TRUE(std::none_of(all.begin(), all.end(),
                           [&](const Recording& known) { return known.id == dropped; }));
  EXPECT_EQ(test::readTexts(*store, sampleBehavior(finished, {"/imported"}, 0, 10)),
            (Texts{"x", "y"}));
  EXPECT_TRUE(store->contextTopics(sampleBehavior(recording, {}, 0, 10)).empty());
}

TEST_P(StoreSuite, recordingsAreKnownByTheirKeys) {
  const std::string key = newKey();
  const std::int64_t id = store->addRecording({0, key, "a.bag", "r"});
  EXPECT_EQ(store->addRecording({0, key, "another", ""}), id);
  const auto all = store->recordings();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].key.size(), 32u);
  EXPECT_EQ(all[1].id, id);
  EXPECT_EQ(all[1].source, "a.bag");
  EXPECT_EQ(all[1].robot, "r");
}

TEST_P(StoreSuite, channelsAreStoredOnceAndComeBackWhole) {
  Channel channel = stringChannel("/a", "/talker", true);
  channel.definition += "# \xE9 in Latin-1\n";
  const std::int64_t id = store->addChannel(recording, channel);
  EXPECT_EQ(store->addChannel(recording, channel), id);
  EXPECT_EQ(store->channel(id), channel);
  channel.caller_id = "/other";
  EXPECT_NE(store->addChannel(recording, channel), id);
  EXPECT_THROW(store->addChannel(4711, channel), StoreError);
  EXPECT_THROW(store->channel(4711), StoreError);
}

TEST_P(StoreSuite, messagesComeInOrderOverAllTopics) {
  store->append({message("/a", 20, 4, "d"), message("/a/b", 10, 2, "b"),
                 message("/a_b", 10, 3, "c"), message("/a", 10, 1, "a")});
  MessageRange range;
  range.topics = {"/a", "/a/b", "/a_b"};
  EXPECT_EQ(texts(range), (Texts{"a", "b", "c", "d"}));
  range.topics = {"/a_b"};
  EXPECT_EQ(texts(range), Texts{"c"}) << "/a/b has the same collection";
  range.topics.clear();
  EXPECT_EQ(texts(range), (Texts{"a", "d"}));
  range.with_all_topics = true;
  EXPECT_EQ(texts(range), (Texts{"a", "b", "c", "d"}));
}

TEST_P(StoreSuite, aLongReadHasEveryMessageOnce) {
  const std::int64_t a = channel("/a"), b = channel("/b");
  std::vector<Message> messages;
  for (std::int64_t i = 0; i < 2500; ++i) {
    messages.push_back(stringMessage(i % 5 == 3 ? b : a, i / 40, static_cast<std::uint64_t>(i),
                                     std::to_string(i)));
  }
  store->append(messages);
  MessageRange range;
  range.with_all_topics = true;
  const auto read = texts(range);
  ASSERT_EQ(read.size(), 2500u);
  for (std::size_t i = 0; i < read.size(); ++i) ASSERT_EQ(read[i], std::to_string(i));
}

TEST_P(StoreSuite, intervalsAreHalfOpen) {
  store->append({message("/a", 1, 1, "a"), message("/a", 2, 2, "b"), message("/a", 3, 3, "c")});
  EXPECT_EQ(texts({}, 1, 3), (Texts{"a", "b"}));
  MessageRange range;
  range.begin = Stamp{2};
  range.end = Stamp{3};
  EXPECT_EQ(texts(range), Texts{"b"});
  Behavior open = sampleBehavior(recording, {"/a"}, 2, 0);
  open.end.reset();
  EXPECT_EQ(test::readTexts(*store, open), (Texts{"b", "c"}));
}

TEST_P(StoreSuite, recordingsAreKeptApart) {
  const std::int64_t other = store->addRecording({0, "", "other", "fetch7"});
  const std::int64_t its_channel = store->addChannel(other, stringChannel("/a"));
  store->append({message("/a", 1, 1, "mine")});
  store->append({stringMessage(its_channel, 1, 1, "its")});
  EXPECT_EQ(texts(), Texts{"mine"});
}

TEST_P(StoreSuite, aMessageIsThereOnce) {
  store->append({message("/a", 1, 1, "a")});
  EXPECT_THROW(store->append({message("/a", 2, 2, "b"), message("/a", 1, 1, "a")}), StoreError);
  EXPECT_EQ(texts(), Texts{"a"}) << "none of a batch that was refused";
  store->append({message("/a", 1, 1, "a"), message("/a", 2, 2, "b")}, Duplicates::Skip);
  EXPECT_EQ(texts(), (Texts{"a", "b"}));
}

TEST_P(StoreSuite, behaviorsComeBackWhole) {
  Behavior written = sampleBehavior(recording, {"/a", "/b"}, 10, 20);
  written.tree_path = "kitting/pick \xC3\xA9";
  written.parent = 7;
  written.attempt = 3;
  written.outcome = "failure";
  written.wall_begin = {12};
  written.robot = "fetch7";
  written.parameters = R"({"object": "gear"})";
  written.tags = {"keep", "x"};
  written.calibration = R"({"fx": 1.5})";
  written.snapshot = R"({"files": []})";
  written.remarks = {"3 messages dropped"};
  const std::int64_t id = store->addBehavior(written);
  const auto read = store->behavior(id);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->key.size(), 32u);
  EXPECT_EQ(store->behaviorOfKey(read->key)->id, id);
  EXPECT_EQ(read->recording, recording);
  EXPECT_EQ(read->name, "pick");
  EXPECT_EQ(read->tree_path, written.tree_path);
  EXPECT_EQ(read->parent, 7);
  EXPECT_EQ(read->attempt, 3);
  EXPECT_EQ(read->outcome, "failure");
  EXPECT_EQ(read->begin, Stamp{10});
  EXPECT_EQ(read->end, Stamp{20});
  EXPECT_EQ(read->wall_begin, Stamp{12});
  EXPECT_EQ(read->robot, "fetch7");
  EXPECT_EQ(read->parameters, written.parameters);
  EXPECT_EQ(read->tags, written.tags);
  EXPECT_EQ(read->calibration, written.calibration);
  EXPECT_EQ(read->topics, written.topics);
  EXPECT_EQ(read->snapshot, written.snapshot);
  EXPECT_EQ(read->remarks, written.remarks);
  EXPECT_FALSE(store->behavior(4711));
  EXPECT_FALSE(store->behaviorOfKey("nobody"));
}

TEST_P(StoreSuite, behaviorsKeepIdAndKey) {
  Behavior behavior = sampleBehavior(recording, {}, 1, 2);
  behavior.key = newKey();
  const std::int64_t id = store->addBehavior(behavior);
  EXPECT_THROW(store->addBehavior(behavior), StoreError);
  behavior.id = id;
  behavior.name = "place";
  store->updateBehavior(behavior);
  EXPECT_EQ(store->behavior(id)->name, "place");
  EXPECT_EQ(store->behavior(id)->key, behavior.key);
  behavior.parameters = "[]";
  EXPECT_THROW(store->updateBehavior(behavior), StoreError);
  behavior.id = 4711;
  EXPECT_THROW(store->updateBehavior(behavior), StoreError);
  endBehavior(*store, id, Stamp{9}, "success");
  EXPECT_EQ(store->behavior(id)->end, Stamp{9});
}

TEST_P(StoreSuite, behaviorsAreFoundByWhatTheyAre) {
  store->append({message("/a", 15, 1, "x")});
  Behavior first = sampleBehavior(recording, {"/a"}, 10, 20);
  first.outcome = "failure";
  first.robot = "fetch7";
  Behavior second = sampleBehavior(recording, {"/a"}, 20, 30);
  second.name = "place";
  second.tags = {"keep"};
  Behavior open = sampleBehavior(recording, {"/b"}, 12, 0);
  open.name = "watch";
  open.end.reset();
  for (const Behavior& each : {first, second, open}) store->addBehavior(each);

  EXPECT_EQ(names({}), (Texts{"place", "watch", "pick"})) << "newest first";
  BehaviorFilter filter;
  filter.name = "pick";
  EXPECT_EQ(names(filter), Texts{"pick"});
  filter = {};
  filter.outcome = "failure";
  EXPECT_EQ(names(filter), Texts{"pick"});
  filter = {};
  filter.robot = "fetch7";
  EXPECT_EQ(names(filter), Texts{"pick"});
  filter = {};
  filter.tag = "keep";
  EXPECT_EQ(names(filter), Texts{"place"});
  filter = {};
  filter.topic = "/a";
  EXPECT_EQ(names(filter), Texts{"pick"}) << "place heard nothing on it";
  filter = {};
  filter.since = Stamp{15};
  EXPECT_EQ(names(filter), (Texts{"place", "watch", "pick"})) << "watch lasts to the last message";
  filter.since = Stamp{20};
  EXPECT_EQ(names(filter), Texts{"place"});
  filter = {};
  filter.until = Stamp{12};
  EXPECT_EQ(names(filter), Texts{"pick"});
  filter = {};
  filter.limit = 2;
  EXPECT_EQ(names(filter), (Texts{"place", "watch"}));
  filter.limit = 0;
  EXPECT_EQ(names(filter), Texts{});
  EXPECT_FALSE(store->explain(filter).empty());
}

TEST_P(StoreSuite, filtersFindTheSameInEveryStore) {
  test::fillQueryStore(*store);
  BehaviorFilter filter;
  for (const test::QueryCase& each : test::queryCases()) {
    filter.where = std::make_shared<Filter>(Filter::parse(each.filter));
    EXPECT_EQ(names(filter), each.names) << each.filter;
    EXPECT_FALSE(store->explain(filter).empty());
  }
  filter.where.reset();
  filter.name = "pick blue";
  const Behavior pick = store->behaviors(filter).at(0);
  for (const test::MessageCase& each : test::messageCases()) {
    MessageRange range;
    range.topics = {each.topic};
    range.where = std::make_shared<Filter>(Filter::parse(each.filter, Filter::Over::Messages));
    EXPECT_EQ(test::readAll(*store->messages(pick, range)).size(), each.count) << each.filter;
  }
}

TEST_P(StoreSuite, removingABehaviorKeepsWhatOthersCover) {
  const auto outer = store->addBehavior(sampleBehavior(recording, {"/a"}, 10, 20));
  Behavior inner = sampleBehavior(recording, {"/a"}, 12, 15);
  inner.parent = outer;
  const auto child = store->addBehavior(inner);
  store->append({message("/a", 11, 1, "a"), message("/a", 12, 2, "b"), message("/a", 14, 3, "c"),
                 message("/a", 15, 4, "d"), message("/a", 30, 5, "e")});
  store->removeBehavior(outer);
  EXPECT_EQ(texts(), (Texts{"b", "c", "e"}));
  EXPECT_EQ(store->behavior(child)->parent, 0);
  EXPECT_THROW(store->removeBehavior(outer), StoreError);
}

TEST_P(StoreSuite, anEditChangesABehaviorOrNothingOfIt) {
  Behavior behavior = sampleBehavior(recording, {"/a"}, 10, 20);
  behavior.tags = {"old"};
  behavior.snapshot = R"({"urdf":"x"})";
  const auto id = store->addBehavior(behavior);
  BehaviorEdit edit;
  edit.name = "grasp";
  edit.outcome = "failure";
  edit.add_tags = {"demo", "demo"};
  edit.remove_tags = {"old"};
  edit.notes = {"the gripper slipped"};
  editBehavior(*store, id, edit);
  const Behavior edited = store->behavior(id).value();
  EXPECT_EQ(edited.name, "grasp");
  EXPECT_EQ(edited.outcome, "failure");
  EXPECT_EQ(edited.tags, Texts{"demo"});
  EXPECT_EQ(notesOf(edited), Texts{"the gripper slipped"});
  EXPECT_NE(edited.snapshot.find("urdf"), std::string::npos);
  edit.name = "never";
  EXPECT_THROW(editBehavior(*store, id, edit), StoreError) << "the tag is gone";
  EXPECT_EQ(store->behavior(id)->name, "grasp");
  EXPECT_THROW(editBehavior(*store, id + 7, {}), StoreError);
}

/// What an edit is refused with; the behavior stays as it was.
std::string refusalOf(Store& store, std::int64_t id, const BehaviorEdit& edit) {
  const Behavior before = store.behavior(id).value();
  std::string why;
  try {
    editBehavior(store, id, edit);
  } catch (const StoreError& error) {
    why = error.what();
  }
  const Behavior after = store.behavior(id).value();
  EXPECT_EQ(std::tie(after.name, after.tags, after.begin, after.end, after.snapshot),
            std::tie(before.name, before.tags, before.begin, before.end, before.snapshot));
  return why;
}

TEST_P(StoreSuite, anEditThatWouldHideABehaviorOrLeaveNothingOfItIsRefused) {
  const auto id = store->addBehavior(sampleBehavior(recording, {"/a"}, 10, 20));
  const std::string behavior = "behavior " + std::to_string(id);
  BehaviorEdit edit;
  edit.name = "";
  EXPECT_EQ(refusalOf(*store, id, edit), "an empty name: a behavior is found by its name");
  edit = {};
  edit.add_tags = {"demo", ""};
  EXPECT_EQ(refusalOf(*store, id, edit), "an empty tag finds nothing");
  edit = {};
  edit.remove_tags = {"demo"};
  EXPECT_EQ(refusalOf(*store, id, edit), behavior + " has no tag \"demo\"");
  const std::optional<std::int64_t> cuts[][2] = {{-1, 5}, {5, 5}, {6, 5}, {5, 11}, {10, {}}};
  for (const auto& [from, to] : cuts) {
    edit = {};
    edit.from_ns = from;
    edit.to_ns = to;
    EXPECT_EQ(refusalOf(*store, id, edit),
              behavior +
                  " is 0 ms long: the part that stays has to begin and end within, in this "
                  "order")
        << *from;
  }
}

TEST_P(StoreSuite, aTrimForgetsTheFramesOfMomentsThatAreNoLongerItsBeginOrEnd) {
  const auto framesAfter = [&](std::optional<std::int64_t> from, std::optional<std::int64_t> to) {
    Behavior behavior = sampleBehavior(recording, {"/a"}, 10, 20);
    behavior.wall_begin = Stamp{1000};
    behavior.snapshot = R"({"frames": {"begin": 1, "end": 2}, "urdf": "x"})";
    const auto id = store->addBehavior(behavior);
    BehaviorEdit edit;
    edit.from_ns = from;
    edit.to_ns = to;
    const Behavior edited = editBehavior(*store, id, edit);
    EXPECT_EQ(edited.wall_begin, Stamp{1000 + from.value_or(0)});
    const auto snapshot = nlohmann::json::parse(store->behavior(id)->snapshot);
    EXPECT_EQ(snapshot["urdf"], "x");
    return snapshot["frames"].dump();
  };
  EXPECT_EQ(framesAfter(2, {}), R"({"end":2})");
  EXPECT_EQ(framesAfter({}, 9), R"({"begin":1})");
  EXPECT_EQ(framesAfter(2, 9), "{}");
  EXPECT_EQ(framesAfter(0, 10), R"({"begin":1,"end":2})") << "nothing is cut off";
}

TEST(Notes, areTheTextsAmongWhatASnapshotCallsNotes) {
  Behavior behavior;
  const auto notesIn = [&](const char* snapshot) {
    behavior.snapshot = snapshot;
    return notesOf(behavior);
  };
  EXPECT_EQ(notesIn(R"({"notes": ["slipped", 7, null, "fell"]})"), (Texts{"slipped", "fell"}));
  for (const char* none : {"{}", "[]", "no JSON", R"({"notes": "slipped"})"}) {
    EXPECT_EQ(notesIn(none), Texts{}) << none;
  }
}

TEST_P(StoreSuite, whatIsBeingRecordedIsNotEdited) {
  Behavior behavior = sampleBehavior(recording, {"/a"}, 10, 20);
  behavior.end.reset();
  const auto id = store->addBehavior(behavior);
  BehaviorEdit edit;
  edit.name = "grasp";
  EXPECT_THROW(editBehavior(*store, id, edit), StoreError);
}

TEST_P(StoreSuite, aTrimKeepsWhatIsNeededStill) {
  const auto latched = store->addChannel(recording, stringChannel("/map", "/server", true));
  const auto id = store->addBehavior(sampleBehavior(recording, {"/a"}, 10, 20));
  store->addBehavior(sampleBehavior(recording, {"/a"}, 17, 19));
  store->append({stringMessage(latched, 10, 1, "old map"), stringMessage(latched, 11, 2, "map"),
                 message("/a", 12, 3, "a"), message("/a", 13, 4, "b"), message("/a", 15, 5, "c"),
                 message("/a", 16, 6, "d"), message("/a", 18, 7, "e"), message("/a", 19, 8, "f")});
  BehaviorEdit edit;
  edit.from_ns = 3;
  edit.to_ns = 6;
  const Behavior edited = editBehavior(*store, id, edit);
  EXPECT_EQ(edited.begin, Stamp{13});
  EXPECT_EQ(edited.end, Stamp{16});
  EXPECT_EQ(store->behaviors({}).size(), 2u);
  MessageRange all;
  all.with_all_topics = true;
  EXPECT_EQ(texts(all), (Texts{"b", "map", "c", "e"}));
  ASSERT_EQ(store->topics(edited).size(), 1u);
  EXPECT_EQ(store->topics(edited)[0].count, 2u);
  edit.to_ns = 4;
  EXPECT_THROW(editBehavior(*store, id, edit), StoreError) << "it is shorter now";
  EXPECT_EQ(texts(all), (Texts{"b", "map", "c", "e"}));
}

/// As a late subscriber to rosbag play gets them.
TEST_P(StoreSuite, aTrimKeepsTheLastMessageOfEachLatchedPublisher) {
  const auto one = store->addChannel(recording, stringChannel("/map", "/one", true));
  const auto other = store->addChannel(recording, stringChannel("/map", "/other", true));
  const auto plain = store->addChannel(recording, stringChannel("/map", "/plain"));
  const auto id = store->addBehavior(sampleBehavior(recording, {"/map"}, 10, 20));
  store->append({stringMessage(one, 10, 1, "old of one"), stringMessage(one, 11, 2, "of one"),
                 stringMessage(other, 12, 3, "of other"), stringMessage(plain, 13, 4, "gone"),
                 stringMessage(plain, 15, 5, "later")});
  BehaviorEdit edit;
  edit.from_ns = 4;
  edit.to_ns = 8;
  editBehavior(*store, id, edit);
  MessageRange all;
  all.with_all_topics = true;
  EXPECT_EQ(texts(all), (Texts{"of one", "of other", "later"}));
}

TEST_P(StoreSuite, aTrimMakesNoCopyOfWhatIsSaidAtItsBegin) {
  const auto latched = store->addChannel(recording, stringChannel("/map", "/one", true));
  Behavior behavior = sampleBehavior(recording, {"/map"}, 10, 20);
  behavior.snapshot = R"({"frames": 5})";
  const auto id = store->addBehavior(behavior);
  store->append({stringMessage(latched, 11, 1, "old"), stringMessage(latched, 14, 2, "new")});
  BehaviorEdit edit;
  edit.from_ns = 4;
  EXPECT_EQ(editBehavior(*store, id, edit).snapshot, R"({"frames": 5})");
  EXPECT_EQ(texts(MessageRange{{"/map"}}), Texts{"new"});
}

TEST_P(StoreSuite, topicsAreSummedUpByTypeAndOwnership) {
  store->append({message("/a", 1, 1, "a"), message("/a", 3, 2, "b"), message("/b", 2, 3, "c")});
  const Behavior behavior = sampleBehavior(recording, {"/a", "/silent"}, 0, 9);
  const auto own = store->topics(behavior);
  ASSERT_EQ(own.size(), 1u);
  EXPECT_EQ(own[0].topic, "/a");
  EXPECT_EQ(own[0].type, "std_msgs/String");
  EXPECT_EQ(own[0].count, 2u);
  EXPECT_EQ(own[0].first, Stamp{1});
  EXPECT_EQ(own[0].last, Stamp{3});
  const auto context = store->contextTopics(behavior);
  ASSERT_EQ(context.size(), 1u);
  EXPECT_EQ(context[0].topic, "/b");
}

TEST(TopicSummary, hasARateFromTheSecondMessageOn) {
  EXPECT_EQ((TopicSummary{"/a", "t/T", 5, Stamp{0}, Stamp{2'000'000'000}}.rate_hz()), 2.0);
  EXPECT_FALSE((TopicSummary{"/a", "t/T", 1, Stamp{0}, Stamp{0}}.rate_hz()));
  EXPECT_FALSE((TopicSummary{"/a", "t/T", 3, Stamp{4}, Stamp{4}}.rate_hz())) << "all at once";
}

/// As the scene of a moment is put together: topics may have been silent for long.
TEST_P(StoreSuite, theNewestMessageBeforeAMomentIsFoundHoweverLongAgoItCame) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  store->append({message("/a", 5, 1, "first"), message("/a", 40 * kSecond, 2, "second"),
                 message("/a", 40 * kSecond, 3, "at once"),
                 message("/b", 41 * kSecond, 4, "other")});
  const Behavior behavior = sampleBehavior(recording, {"/a"}, 5, 50 * kSecond);
  const auto newest = [&](const std::string& topic, std::int64_t moment_ns) {
    const auto found = newestMessage(*store, behavior, topic, Stamp{moment_ns});
    return found ? test::textOf(*found) : "";
  };
  EXPECT_EQ(newest("/a", 49 * kSecond), "at once") << "of two at one time the last sent";
  EXPECT_EQ(newest("/a", 40 * kSecond), "at once") << "the moment itself counts";
  EXPECT_EQ(newest("/a", 40 * kSecond - 1), "first");
  EXPECT_EQ(newest("/a", 5), "first");
  EXPECT_EQ(newest("/a", 4), "") << "before the behavior's begin";
  EXPECT_EQ(newest("/b", 49 * kSecond), "other") << "of its context";
  EXPECT_EQ(newest("/b", 40 * kSecond), "");
}

TEST_P(StoreSuite, definitionsThatCannotBeUnderstoodAreRefusedEachTime) {
  KnownChannels channels(*store);
  const std::int64_t bad = store->addChannel(
      recording, {"/x", "t/T", std::string(32, '0'), "this is no definition !\n", false, ""});
  for (int round = 0; round < 2; ++round) EXPECT_THROW(channels.schema(bad), MessageError);
  EXPECT_EQ(channels.channel(bad).topic, "/x");
  EXPECT_EQ(channels.schema(channel("/a")).types().front().name, "std_msgs/String");
  EXPECT_THROW(channels.channel(4711), StoreError);
}

TEST_P(StoreSuite, aSequenceBeyondWhatTheStoreCountsIsRefused) {
  const std::uint64_t most = std::numeric_limits<std::int64_t>::max();
  store->append({message("/a", 1, most, "last")});
  try {
    store->append({message("/a", 2, 1, "a"), message("/a", 3, most + 1, "beyond")});
    ADD_FAILURE() << "stored";
  } catch (const StoreError& error) {
    EXPECT_NE(std::string(error.what()).find("a sequence of 9223372036854775808 is too large"),
              std::string::npos)
        << error.what();
  }
  EXPECT_EQ(texts(), Texts{"last"}) << "nothing of that append";
}

TEST_P(StoreSuite, anAppendMayHoldMessagesOfSeveralRecordings) {
  const std::int64_t other = store->addRecording({0, "", "other", "fetch8"});
  const std::int64_t there = store->addChannel(other, stringChannel("/a"));
  store->append({message("/a", 1, 1, "here"), stringMessage(there, 1, 1, "there"),
                 message("/a", 2, 2, "here, too")});
  EXPECT_EQ(texts(), (Texts{"here", "here, too"}));
  EXPECT_EQ(test::readTexts(*store, sampleBehavior(other, {"/a"}, 0, 9)), Texts{"there"});
  EXPECT_THROW(store->append({message("/a", 3, 3, "new"), stringMessage(there, 1, 1, "there")}),
               StoreError);
  EXPECT_EQ(texts(), (Texts{"here", "here, too"})) << "all of an append or nothing";
}

TEST_P(StoreSuite, objectsThatAreNoneOrNestedTooDeepAreRefused) {
  const auto refusal = [&](const std::string& parameters) -> std::string {
    Behavior behavior = sampleBehavior(recording, {"/a"}, 0, 9);
    behavior.parameters = parameters;
    try {
      store->addBehavior(behavior);
    } catch (const StoreError& error) {
      return error.what();
    }
    return "";
  };
  const std::string what = "parameters of behavior \"pick\": ";
  EXPECT_NE(refusal(R"({"x": )" + std::string(10'000, '[') + std::string(10'000, ']') + "}")
                .find(what + "nested too deep"),
            std::string::npos);
  EXPECT_NE(refusal("[1]").find(what + "no JSON object"), std::string::npos);
  EXPECT_NE(refusal("{").find(what + "no JSON object"), std::string::npos);
  EXPECT_TRUE(store->behaviors({}).empty());
}

TEST_P(StoreSuite, filesAreKeptByTheirSum) {
  const std::string sum(64, 'a');
  const Bytes contents{0, 1, 255};
  store->addFile(sum, contents);
  store->addFile(sum, contents);
  EXPECT_EQ(store->file(sum), contents);
  EXPECT_FALSE(store->file(std::string(64, 'b')));
}

TEST_P(StoreSuite, aTransactionThatThrowsLeavesNothing) {
  const auto kept = store->addBehavior(sampleBehavior(recording, {"/a"}, 0, 9));
  store->append({message("/a", 1, 1, "a")});
  const auto fail = [&] {
    store->transaction([&] {
      store->append({message("/a", 2, 2, "b")});
      store->addBehavior(sampleBehavior(recording, {"/new"}, 0, 9));
      endBehavior(*store, kept, Stamp{5}, "success");
      store->removeBehavior(kept);
      throw std::runtime_error("enough");
    });
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_EQ(texts(), Texts{"a"});
  EXPECT_EQ(names({}), Texts{"pick"});
  EXPECT_EQ(store->behavior(kept)->end, Stamp{9});
  store->transaction([&] { store->removeBehavior(kept); });
  EXPECT_EQ(texts(), Texts{});
}

TEST_P(StoreSuite, aTransactionThatThrowsForgetsItsRecordingsAndChannels) {
  std::int64_t gone_recording = 0, gone_channel = 0;
  const auto fail = [&] {
    store->transaction([&] {
      gone_recording = store->addRecording({0, "", "gone", ""});
      gone_channel = store->addChannel(gone_recording, stringChannel("/gone"));
      store->append({stringMessage(gone_channel, 1, 1, "gone")});
      store->addFile(std::string(64, 'a'), {1});
      throw std::runtime_error("enough");
    });
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_EQ(store->recordings().size(), 1u);
  EXPECT_THROW(store->channel(gone_channel), StoreError);
  EXPECT_THROW(store->addChannel(gone_recording, stringChannel("/gone")), StoreError);
  EXPECT_FALSE(store->file(std::string(64, 'a')));
}

TEST_P(StoreSuite, aFinishedImportWhoseTransactionFailsIsUnfinishedStill) {
  const std::int64_t id = store->beginImport({0, "", "a.bag", ""});
  const auto fail = [&] {
    store->transaction([&] {
      store->finishImport(id);
      throw std::runtime_error("enough");
    });
  };
  EXPECT_THROW(fail(), std::runtime_error);
  store->finishImport(id);
}

template <typename T>
Bytes bytesOf(T value) {
  Bytes bytes(sizeof value);
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

TEST_P(StoreSuite, awkwardMessagesComeBackByteForByte) {
  std::string deep_definition = "t/M1 m\n", deep_name = "m";
  for (int level = 1; level < 150; ++level) {
    const std::string next = level == 149 ? "int8 x\n" : "t/M" + std::to_string(level + 1) + " m\n";
    deep_definition += std::string(80, '=') + "\nMSG: t/M" + std::to_string(level) + "\n" + next;
  }
  const struct {
    const char* type;
    std::string definition;
    Bytes bytes;
  } cases[] = {
      {"std_msgs/Empty", "", {}},
      {"std_msgs/Float64", "float64 data\n", bytesOf(std::numeric_limits<double>::quiet_NaN())},
      {"std_msgs/Float64", "float64 data\n", bytesOf(std::numeric_limits<double>::infinity())},
      {"std_msgs/Float32", "float32 data\n", bytesOf(std::numeric_limits<float>::signaling_NaN())},
      {"std_msgs/UInt64", "uint64 data\n", bytesOf(std::numeric_limits<std::uint64_t>::max())},
      {"std_msgs/Bool", "bool data\n", {7}},
      {"std_msgs/String", "string data\n", test::stringBytes("\xFF\xFE is no UTF-8")},
      {"std_msgs/String", "string data\n", test::stringBytes(std::string("a\0b", 3))},
      {"std_msgs/String", "string data\n", {1, 2, 3}},           // does not fit
      {"std_msgs/String", "this is no definition !\n", {1, 2}},  // cannot be understood
      {"std_msgs/UInt8MultiArray", "uint8[] data\n", {3, 0, 0, 0, 1, 2, 3}},
      {"t/Deep", deep_definition, {5}},
  };
  for (const auto& each : cases) {
    EXPECT_EQ(throughStore(each.type, each.definition, each.bytes), each.bytes) << each.type;
  }
}

TEST_P(StoreSuite, messagesOver16MiBComeBackByteForByte) {
  const std::size_t size = 17 << 20;
  Bytes bytes = bytesOf(static_cast<std::uint32_t>(size));
  for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(i * i >> 7));
  EXPECT_EQ(throughStore("std_msgs/ByteMultiArray", "uint8[] data\n", bytes), bytes);
  const auto removed = store->addBehavior(sampleBehavior(recording, {"/x"}, 0, 9));
  store->removeBehavior(removed);
  MessageRange all;
  all.topics = {"/x"};
  EXPECT_TRUE(test::readAll(*store->messages(sampleBehavior(recording, {}, 0, 9), all)).empty());
}

TEST_P(StoreSuite, openingForReadingDemandsAStore) {
  store->addBehavior(sampleBehavior(recording, {"/a"}, 0, 9));
  const auto reader = openStore(uri, OpenMode::ReadOnly);
  EXPECT_EQ(reader->behaviors({}).size(), 1u);
  EXPECT_THROW(reader->addRecording({}), StoreError);
  const std::string missing =
      GetParam() == std::string("SQLite") ? folder.path("none.db") : server().uri();
  EXPECT_THROW(openStore(missing, OpenMode::ReadOnly), StoreError);
}

INSTANTIATE_TEST_SUITE_P(Stores, StoreSuite, testing::Values("SQLite", "MongoDB"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace afterglow::replay::store_suite_test
