#include "replay/record/recorder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "tests/support/faulty_store.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::recorder_test {
namespace {

Channel channel(const std::string& topic, bool latching = false, const std::string& caller = "/a") {
  return {topic,           "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1",
          "string data\n", latching,          caller};
}

Bytes text(const std::string& data) {
  Bytes bytes(4 + data.size());
  bytes[0] = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), bytes.begin() + 4);
  return bytes;
}

/// A text of 1000 bytes in all.
Bytes kilobyte() {
  Bytes bytes(1000, 'x');
  bytes[0] = 996 % 256;
  bytes[1] = 996 / 256;
  bytes[2] = bytes[3] = 0;
  return bytes;
}

Behavior behavior(const std::string& name, std::vector<std::string> topics, std::int64_t begin) {
  Behavior made;
  made.name = name;
  made.topics = std::move(topics);
  made.begin = {begin};
  return made;
}

std::vector<std::string> texts(const Store& store, std::int64_t id) {
  std::vector<std::string> found;
  const Behavior stored = *store.behavior(id);
  const auto cursor = store.messages(stored, {stored.topics, {}, {}});
  while (const auto message = cursor->next()) {
    found.emplace_back(message->bytes.begin() + 4, message->bytes.end());
  }
  return found;
}

using Texts = std::vector<std::string>;

struct RecorderTest : testing::Test {
  static RecorderOptions options() {
    RecorderOptions chosen;
    chosen.batch_period = std::chrono::milliseconds(1);
    chosen.context_topics = {"/tf", "/tf_static"};
    chosen.robot = "fetch7";
    return chosen;
  }
  test::FaultyStore store;
};

TEST_F(RecorderTest, keepsWhatArrivesWhileABehaviorRuns) {
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  recorder.offer(a, {9}, text("before"));
  const Behavior begun = recorder.begin(behavior("pick", {"/a", "/quiet"}, 10));
  recorder.offer(a, {10}, text("first"));
  recorder.offer(a, {10}, text("tied"));
  recorder.offer(recorder.channelIndex(channel("/other")), {11}, text("not asked for"));
  recorder.offer(recorder.channelIndex(channel("/tf")), {11}, text("context"));
  recorder.offer(a, {19}, text("last"));
  const RecordedCounts counts = recorder.end(begun.id, {20}, test::outcome("success"));
  recorder.offer(a, {21}, text("after"));

  EXPECT_EQ(texts(store, begun.id), (Texts{"first", "tied", "last"}));
  EXPECT_EQ(counts.stored, 3u);
  EXPECT_EQ(counts.dropped, 0u);
  EXPECT_EQ(counts.silent_topics, Texts{"/quiet"});
  const Behavior stored = *store.behavior(begun.id);
  EXPECT_EQ(stored.outcome, "success");
  EXPECT_EQ(stored.end, Stamp{20});
  EXPECT_EQ(stored.robot, "fetch7");
  ASSERT_EQ(store.contextTopics(stored).size(), 1u) << "the context, nothing else";
  EXPECT_EQ(store.contextTopics(stored).front().topic, "/tf");
}

TEST_F(RecorderTest, losesNothingOnEndWhileManyThreadsOffer) {
  RecorderOptions slow = options();
  slow.batch_period = std::chrono::hours(1);  // only end() makes it write
  Recorder recorder(store, slow);
  const Behavior begun = recorder.begin(behavior("pick", {"/a"}, 0));
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&recorder, i] {
      const std::size_t index =
          recorder.channelIndex(channel("/a", false, "/" + std::to_string(i)));
      for (int n = 0; n < 500; ++n) recorder.offer(index, {n}, text("x"));
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(recorder.end(begun.id, {1000}, test::outcome("success")).stored, 2000u);
  EXPECT_EQ(texts(store, begun.id).size(), 2000u);
}

TEST_F(RecorderTest, tellsSendersWithoutEndNotApartForEver) {
  Recorder recorder(store, options());
  const std::size_t first = recorder.channelIndex(channel("/a", false, "/talker_0"));
  for (int i = 1; i < 2000; ++i) {
    recorder.channelIndex(channel("/a", false, "/talker_" + std::to_string(i)));
  }
  EXPECT_EQ(recorder.channelIndex(channel("/a", false, "/one_more")), first);
  EXPECT_EQ(recorder.channelIndex(channel("/a", false, "/talker_7")), 7u) << "it is known";
  EXPECT_EQ(recorder.channelIndex(channel("/b")), 2000u) << "another topic";
  EXPECT_EQ(recorder.channelIndex(channel("/a", true)), 2001u) << "one that latches";
}

TEST_F(RecorderTest, countsWhatDoesNotFitTheQueue) {
  RecorderOptions small = options();
  small.queue_bytes = 4000;
  Recorder recorder(store, small);
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const Behavior begun = recorder.begin(behavior("pick", {"/a"}, 0));
  store.is_stalled = true;
  for (int n = 0; n < 100; ++n) recorder.offer(a, {n}, kilobyte());
  EXPECT_GE(recorder.counts(begun.id).dropped, 96u);
  store.is_stalled = false;
  const RecordedCounts counts = recorder.end(begun.id, {1000}, test::outcome("success"));
  EXPECT_EQ(counts.stored + counts.dropped, 100u);
  const std::string announced = std::to_string(counts.dropped) +
                                " messages on /a were dropped: they came faster than the store "
                                "could write, and the room of 0.0 MB for what waits was full; "
                                "recorder_node's ~queue_megabytes gives more room";
  EXPECT_EQ(counts.remarks, Texts{announced});
  EXPECT_EQ(store.behavior(begun.id)->remarks, Texts{announced});
  EXPECT_EQ(recorder.load().dropped, counts.dropped);
  EXPECT_EQ(recorder.load().queued_bytes, 0u);
  EXPECT_GE(counts.stored, 1u);
  EXPECT_EQ(texts(store, begun.id).size(), counts.stored);
}

TEST_F(RecorderTest, stopsWithTheReasonWhenTheStoreFails) {
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const Behavior first = recorder.begin(behavior("pick", {"/a"}, 0));
  recorder.offer(a, {1}, text("kept"));
  recorder.end(first.id, {5}, test::outcome("success"));
  const Behavior second = recorder.begin(behavior("place", {"/a"}, 10));
  store.failWith("disk full: /tmp/x.db");
  recorder.offer(a, {11}, text("lost"));
  EXPECT_THROW(recorder.end(second.id, {20}, test::outcome("success")), StoreError);
  EXPECT_EQ(recorder.failure(), "disk full: /tmp/x.db");
  try {
    recorder.begin(behavior("again", {"/a"}, 30));
    FAIL() << "a broken recorder must not begin";
  } catch (const StoreError& error) {
    EXPECT_STREQ(error.what(), "disk full: /tmp/x.db");
  }
  EXPECT_EQ(texts(store, first.id), Texts{"kept"});
}

TEST_F(RecorderTest, recordsAgainWhenTheStoreWritesAgain) {
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const Behavior first = recorder.begin(behavior("pick", {"/a"}, 0));
  store.failWith("disk full: /tmp/x.db");
  recorder.offer(a, {1}, text("lost"));
  EXPECT_THROW(recorder.end(first.id, {5}, test::outcome("success")), StoreError);
  store.failWith("");
  const Behavior second = recorder.begin(behavior("place", {"/a"}, 10));
  EXPECT_EQ(recorder.failure(), std::nullopt);
  recorder.offer(a, {11}, text("kept"));
  EXPECT_EQ(recorder.end(second.id, {20}, test::outcome("success")).stored, 1u);
  EXPECT_EQ(texts(store, second.id), Texts{"kept"});
}

TEST_F(RecorderTest, saysOfAMessageThatIsTooLargeThatItIs) {
  RecorderOptions small = options();
  small.queue_bytes = 1'000'000;
  Recorder recorder(store, small);
  const Behavior begun = recorder.begin(behavior("pick", {"/a"}, 0));
  recorder.offer(recorder.channelIndex(channel("/a")), {1}, Bytes(2'500'000));
  EXPECT_EQ(recorder.end(begun.id, {10}, test::outcome("success")).remarks,
            Texts{"1 message on /a was dropped: with 2.5 MB it is larger than the room of 1.0 MB "
                  "for what waits for the store; recorder_node's ~queue_megabytes gives more room"});
}

/// A behavior on /a, whose first message, at 3 ns, is the last before the disk is full.
Behavior cutOff(Recorder& recorder, test::FaultyStore& store) {
  const Behavior cut = recorder.begin(behavior("pick", {"/a"}, 0));
  recorder.offer(recorder.channelIndex(channel("/a")), {3}, text("kept"));
  while (recorder.counts(cut.id).stored == 0) std::this_thread::yield();
  store.failWith("disk full: /tmp/x.db");
  return cut;
}

TEST_F(RecorderTest, endsWhatAFullDiskCutOffAtItsLastStoredMessage) {
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const Behavior cut = cutOff(recorder, store);
  recorder.offer(a, {4}, text("lost"));
  EXPECT_THROW(recorder.end(cut.id, {5}, test::outcome("success")), StoreError);
  store.failWith("");
  const Behavior later = recorder.begin(behavior("place", {"/a"}, 10));
  recorder.offer(a, {11}, text("of another"));
  recorder.end(later.id, {20}, test::outcome("success"));
  EXPECT_EQ(texts(store, cut.id), Texts{"kept"});
  EXPECT_EQ(store.behavior(cut.id)->end, Stamp{4});
  EXPECT_NE(store.behavior(cut.id)->recording, later.recording)
      << "had the recorder died before, it would reach to its recording's end";
  EXPECT_EQ(store.behavior(cut.id)->remarks.back(), "disk full: /tmp/x.db");
}

TEST_F(RecorderTest, endsEachOfSeveralThatAFullDiskCutOffAtItsOwnLastMessage) {
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const std::size_t b = recorder.channelIndex(channel("/b"));
  const Behavior outer = recorder.begin(behavior("kitting", {"/a"}, 0));
  recorder.offer(a, {3}, text("kept"));
  while (recorder.counts(outer.id).stored == 0) std::this_thread::yield();
  const Behavior inner = recorder.begin(behavior("pick", {"/b"}, 5));
  store.failWith("disk full: /tmp/x.db");
  recorder.offer(b, {6}, text("lost"));
  recorder.offer(a, {7}, text("lost"));
  EXPECT_THROW(recorder.end(inner.id, {8}, test::outcome("success")), StoreError);
  EXPECT_THROW(recorder.end(outer.id, {9}, test::outcome("success")), StoreError);
  store.failWith("");
  const Behavior later = recorder.begin(behavior("place", {"/a", "/b"}, 10));
  recorder.offer(b, {11}, text("of another"));
  recorder.end(later.id, {20}, test::outcome("success"));
  EXPECT_EQ(store.behavior(outer.id)->end, Stamp{4});
  EXPECT_EQ(store.behavior(inner.id)->end, Stamp{6}) << "it had none: behind its begin";
  EXPECT_TRUE(texts(store, inner.id).empty());
}

TEST_F(RecorderTest, endsWhatAFullDiskCutOffThereThoughThereIsRoomAgainAtItsEnd) {
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const Behavior cut = cutOff(recorder, store);
  recorder.offer(a, {4}, text("lost"));
  while (!recorder.failure()) std::this_thread::yield();
  store.failWith("");
  recorder.offer(a, {5}, text("lost, too: with a gap it would not be what was"));
  recorder.end(cut.id, {20}, test::outcome("success"));
  EXPECT_EQ(texts(store, cut.id), Texts{"kept"});
  EXPECT_EQ(store.behavior(cut.id)->end, Stamp{4});
  EXPECT_EQ(store.behavior(cut.id)->remarks,
            Texts{"2 messages on /a were dropped: disk full: /tmp/x.db"});
}

TEST_F(RecorderTest, takesTheKnownDefinitionForADefectiveOne) {
  RecorderOptions knowing = options();
  knowing.find_definition = [](const std::string& type) -> std::optional<Definition> {
    if (type != "std_msgs/String") return std::nullopt;
    return Definition{"string data\n", "992ce8a1687cec8c8bd883ec73ca41d1"};
  };
  Recorder recorder(store, knowing);
  Channel defective = channel("/a");
  defective.definition = "";
  const Behavior begun = recorder.begin(behavior("pick", {"/a"}, 0));
  recorder.offer(recorder.channelIndex(defective), {1}, text("x"));
  EXPECT_EQ(recorder.end(begun.id, {10}, test::outcome("success")).remarks,
            Texts{"/a (std_msgs/String) is read by the definition known here, as its own is "
                  "defective: it has no field"});
  const auto stored = *store.behavior(begun.id);
  const auto message = store.messages(stored, {stored.topics, {}, {}})->next();
  EXPECT_EQ(store.channel(message->channel), channel("/a"));
}

TEST_F(RecorderTest, lastsAsLongAsTheSteadyClockWhenTheWallClockIsSetAhead) {
  constexpr std::int64_t kSecond = 1'000'000'000, kDay = 25 * 3600 * kSecond;
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  recorder.look({{100 * kSecond}, {100 * kSecond}, 5 * kSecond, false});
  const Behavior begun = recorder.begin(behavior("pick", {"/a"}, 100 * kSecond));
  recorder.offer(a, {101 * kSecond}, text("before"), 6 * kSecond);
  recorder.offer(a, {kDay + 102 * kSecond}, text("after"), 7 * kSecond);
  recorder.look({{kDay + 103 * kSecond}, {kDay + 103 * kSecond}, 8 * kSecond, false});
  const auto counts = recorder.end(begun.id, {kDay + 110 * kSecond}, test::outcome("success"));
  EXPECT_EQ(store.behavior(begun.id)->end, Stamp{110 * kSecond}) << "10 s, not 90,010 s";
  ASSERT_FALSE(counts.remarks.empty());
  EXPECT_EQ(counts.remarks[0],
            "ROS time was set ahead by 90000.000 s to 90102.000 s; stamps of this recording go on "
            "as before");
  const Behavior next = recorder.begin(behavior("place", {"/a"}, kDay + 120 * kSecond));
  EXPECT_EQ(next.begin, Stamp{kDay + 120 * kSecond}) << "true again";
  recorder.end(next.id, {kDay + 121 * kSecond}, test::outcome("success"));
}

TEST_F(RecorderTest, lastsAsLongAsTheSteadyClockWhenTheWallClockIsSetBack) {
  constexpr std::int64_t kSecond = 1'000'000'000, kDay = 25 * 3600 * kSecond;
  constexpr std::int64_t kNow = 1'000'000 * kSecond;
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  recorder.look({{kNow}, {kNow}, 5 * kSecond, false});
  const Behavior begun = recorder.begin(behavior("pick", {"/a"}, kNow));
  recorder.offer(a, {kNow + kSecond}, text("before"), 6 * kSecond);
  recorder.offer(a, {kNow + 3 * kSecond - kDay}, text("after"), 8 * kSecond);
  recorder.look({{kNow + 4 * kSecond - kDay}, {kNow + 4 * kSecond - kDay}, 9 * kSecond, false});
  const auto counts =
      recorder.end(begun.id, {kNow + 10 * kSecond - kDay}, test::outcome("success"));
  const Behavior stored = *store.behavior(begun.id);
  EXPECT_EQ(stored.end, Stamp{kNow + 10 * kSecond});
  const auto cursor = store.messages(stored, {stored.topics, {}, {}});
  EXPECT_EQ(cursor->next()->received, Stamp{kNow + kSecond});
  EXPECT_EQ(cursor->next()->received, Stamp{kNow + 3 * kSecond}) << "two seconds later, as it was";
  ASSERT_FALSE(counts.remarks.empty());
  EXPECT_EQ(counts.remarks[0],
            "ROS time went back by 90000.000 s to 910003.000 s; from then on stamps of this "
            "recording are 90000.000 s ahead of it");
}

TEST_F(RecorderTest, waitsForABusyStoreAndLosesNothing) {
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const Behavior begun = recorder.begin(behavior("pick", {"/a"}, 0));
  store.keepBusy(true);
  recorder.offer(a, {1}, text("while it is busy"));
  Texts notices;
  while (notices.empty()) notices = recorder.takeNotices();
  const std::string told = "another process writes; what arrives waits in the queue";
  EXPECT_EQ(notices, Texts{told});
  EXPECT_EQ(recorder.failure(), std::nullopt);
  EXPECT_THROW(recorder.begin(behavior("other", {"/b"}, 1)), StoreBusy);
  recorder.offer(a, {2}, text("too"));
  recorder.addTopics(begun.id, {"/late"});
  std::thread other([this] { store.keepBusy(false); });
  const RecordedCounts counts = recorder.end(begun.id, {20}, test::outcome("success"));
  other.join();
  EXPECT_EQ(counts.stored, 2u);
  EXPECT_EQ(counts.remarks, Texts{told}) << "said once";
  EXPECT_EQ(texts(store, begun.id), (Texts{"while it is busy", "too"}));
  EXPECT_EQ(store.behavior(begun.id)->topics, (Texts{"/a", "/late"}));
  EXPECT_EQ(store.behavior(begun.id)->outcome, "success");
}

TEST_F(RecorderTest, saysOfABusyStoreThatItsQueueWasFull) {
  RecorderOptions small = options();
  small.queue_bytes = 4000;
  Recorder recorder(store, small);
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const Behavior begun = recorder.begin(behavior("pick", {"/a"}, 0));
  store.keepBusy(true);
  recorder.offer(a, {1}, Bytes(4));
  while (recorder.takeNotices().empty()) std::this_thread::yield();
  for (int n = 2; n < 12; ++n) recorder.offer(a, {n}, kilobyte());
  store.keepBusy(false);
  const RecordedCounts counts = recorder.end(begun.id, {1000}, test::outcome("success"));
  EXPECT_EQ(counts.stored + counts.dropped, 11u);
  EXPECT_NE(counts.remarks.back().find("/a were dropped: the store was busy for longer than the "
                                       "room of 0.0 MB lasted"),
            std::string::npos)
      << counts.remarks.back();
}

TEST_F(RecorderTest, endsAtOnceWhenItIsHurried) {
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const Behavior begun = recorder.begin(behavior("pick", {"/a"}, 0));
  store.keepBusy(true);
  recorder.offer(a, {1}, text("lost"));
  recorder.hurry();
  EXPECT_THROW(recorder.end(begun.id, {20}, test::outcome("success")), StoreBusy);
}

TEST_F(RecorderTest, outlivesAnySingleMessage) {
  const std::string sound = "int8 sound\nint8 command\nfloat32 volume\nstring arg\nstring arg2\n";
  // A publisher says itself how its type is defined.
  const std::string strange =
      "string arg\nstring arg2\nE sound\n===\nMSG: sound_play/E\n";
  store.refuseLargerThan(100);
  for (const std::string& definition : {sound, strange}) {
    Recorder recorder(store, options());
    const std::size_t a = recorder.channelIndex(
        {"/robotsound", "sound_play/SoundRequest", std::string(32, '0'), definition, false, "/x"});
    const Behavior begun = recorder.begin(behavior("pick", {"/robotsound"}, 0));
    const bool is_strange = definition == strange;
    for (std::size_t size = 0; size < 40; ++size) {
      if (size == 14 || size == 8) continue;
      recorder.offer(a, {static_cast<std::int64_t>(size)}, Bytes(size));
    }
    recorder.offer(a, {50}, Bytes(is_strange ? 8 : 14));  // one that fits
    recorder.offer(a, {51}, Bytes(101));
    const RecordedCounts counts = recorder.end(begun.id, {60}, test::outcome("success"));
    EXPECT_EQ(recorder.failure(), std::nullopt);
    EXPECT_EQ(counts.stored, 39u);
    EXPECT_EQ(counts.dropped, 1u);
    EXPECT_EQ(counts.remarks,
              (Texts{"1 message on /robotsound was left out: too large",
                     "39 messages on /robotsound were not of its type by the bytes, and kept as it "
                     "came"}));
  }
}

TEST_F(RecorderTest, recordsNestedBehaviorsOverOneLog) {
  Recorder recorder(store, options());
  const std::size_t a = recorder.channelIndex(channel("/a"));
  const std::size_t b = recorder.channelIndex(channel("/b"));
  Behavior outer = behavior("kitting", {"/a", "/b"}, 0);
  outer.tree_path = "kitting";
  outer = recorder.begin(outer);
  recorder.offer(a, {1}, text("1"));
  Behavior inner = behavior("pick", {"/b"}, 2);
  inner.tree_path = "kitting/pick";
  inner = recorder.begin(inner);
  recorder.offer(a, {3}, text("3"));
  recorder.offer(b, {4}, text("4"));
  EXPECT_EQ(recorder.end(inner.id, {5}, test::outcome("failure")).stored, 1u);
  recorder.offer(b, {6}, text("6"));
  EXPECT_EQ(recorder.end(outer.id, {7}, test::outcome("success")).stored, 4u);

  EXPECT_EQ(inner.parent, outer.id);
  EXPECT_EQ(texts(store, inner.id), Texts{"4"});
  EXPECT_EQ(texts(store, outer.id), (Texts{"1", "3", "4", "6"}));
}

TEST_F(RecorderTest, startsEveryBehaviorWithTheLatchedStateInForce) {
  Recorder recorder(store, options());
  const std::size_t map = recorder.channelIndex(channel("/map", true));
  const std::size_t map_of_other = recorder.channelIndex(channel("/map", true, "/other"));
  const std::size_t fixed = recorder.channelIndex(channel("/tf_static", true));
  recorder.offer(map, {1}, text("old"));
  recorder.offer(map, {2}, text("new"));
  recorder.offer(map_of_other, {3}, text("other"));
  recorder.offer(recorder.channelIndex(channel("/unlatched")), {3}, text("gone"));
  recorder.offer(fixed, {3}, text("lens"));
  recorder.offer(fixed, {3}, text("gripper"));
  recorder.offer(fixed, {3}, text("lens"));
  for (const std::int64_t begin : {10, 20}) {
    const Behavior begun = recorder.begin(behavior("pick", {"/map", "/unlatched"}, begin));
    const RecordedCounts counts = recorder.end(begun.id, {begin + 5}, test::outcome("success"));
    EXPECT_EQ(texts(store, begun.id), (Texts{"new", "other"}));
    EXPECT_EQ(counts.silent_topics, Texts{"/unlatched"});
    EXPECT_EQ(store.contextTopics(*store.behavior(begun.id)).front().count, 2u)
        << "both static transforms";
  }
  recorder.forgetLatched("/map");
  const Behavior begun = recorder.begin(behavior("pick", {"/map"}, 30));
  recorder.end(begun.id, {35}, test::outcome("success"));
  EXPECT_TRUE(texts(store, begun.id).empty());
}

TEST_F(RecorderTest, refusesToEndWhatDoesNotRun) {
  Recorder recorder(store, options());
  EXPECT_THROW(recorder.end(7, {1}, test::outcome("success")), std::logic_error);
}

TEST(RunningBehaviors, countAMessageForEachBehaviorThatCoversIt) {
  RunningBehaviors running({"/tf"});
  Behavior outer = behavior("kitting", {"/a", "/arm/goal"}, 0);
  outer.tree_path = "kitting";
  const std::int64_t outer_provisional = running.add(outer, {});
  EXPECT_LT(outer_provisional, 0);
  running.rename(outer_provisional, 7);
  Behavior inner = behavior("pick", {"/b"}, 10);
  inner.tree_path = "kitting/pick";
  inner.attempt = 0;
  running.rename(running.add(inner, {TopicLimit::parse("/b every=2")}), 8);
  EXPECT_EQ(inner.parent, 7);
  EXPECT_EQ(inner.attempt, 1);

  const auto covering = [&](const std::string& topic, std::int64_t received) {
    std::vector<std::string> names;
    running.forCovering(topic, {received},
                        [&](RunningBehavior& each) { names.push_back(each.behavior().name); });
    return names;
  };
  EXPECT_EQ(covering("/tf", 5), Texts{"kitting"}) << "before the inner one began";
  EXPECT_EQ(covering("/tf", 10), (Texts{"kitting", "pick"}));
  EXPECT_EQ(covering("/arm/result", 10), Texts{"kitting"}) << "a result of its goal";
  EXPECT_EQ(covering("/arm/cancel", 10), Texts{"kitting"}) << "a cancel of its goal";
  EXPECT_EQ(covering("/other", 10), Texts());
  using Want = RunningBehaviors::Want;
  EXPECT_EQ(running.wants("/b", {10}), Want::Yes);
  EXPECT_EQ(running.wants("/b", {11}), Want::LeftOut) << "every second one";
  EXPECT_EQ(running.wants("/other", {11}), Want::No);
  running.remove(8);
  EXPECT_THROW(running.at(8), std::logic_error);
  EXPECT_EQ(running.find(8), nullptr);
  EXPECT_FALSE(running.empty());
}

TEST(StoreWriter, tellsOfEachMessageOnceAndResumesAfterAFailure) {
  test::FaultyStore store;
  const std::int64_t recording = store.addRecording({0, "", "test", ""});
  const Channel a = channel("/a");
  std::atomic<int> written{0}, given_up{0};
  StoreRetry retry([](const std::string&) {});
  StoreWriter writer(store, retry, 4000, std::chrono::milliseconds(1),
                     [&](const auto& batch, const auto& failure) {
                       (failure ? given_up : written) += static_cast<int>(batch.size());
                     });
  std::uint64_t sequence = 0;
  const auto push = [&](Bytes bytes) {
    QueuedMessage queued;
    queued.recording = recording;
    queued.channel = &a;
    queued.message = {0, Stamp{static_cast<std::int64_t>(sequence)}, sequence, {}, bytes};
    ++sequence;
    return writer.push(std::move(queued));
  };
  EXPECT_FALSE(push(Bytes(4000))) << "there is no room for it";
  EXPECT_TRUE(push(text("kept")));
  writer.flush();
  EXPECT_EQ(written, 1);
  EXPECT_EQ(writer.queuedBytes(), 0u);
  store.failWith("disk full");
  EXPECT_TRUE(push(text("lost")));
  writer.flush();
  EXPECT_EQ(given_up, 1);
  EXPECT_EQ(writer.failure(), "disk full");
  EXPECT_FALSE(push(text("not taken")));
  store.failWith("");
  writer.resume();
  EXPECT_TRUE(push(text("again")));
  writer.flush();
  EXPECT_EQ(written, 2);
}

}  // namespace
}  // namespace afterglow::replay::recorder_test
