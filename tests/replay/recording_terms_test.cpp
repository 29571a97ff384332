// On what terms a recording runs: which topics, how many of their messages, since when, on which
// clock, and what it keeps beside them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "replay/record/disk_guard.hpp"
#include "replay/record/recorder.hpp"
#include "replay/record/recording_clock.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/record/topic_choice.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/checksum.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::recording_terms_test {
namespace {

using test::stringBytes;
using test::stringChannel;
using Texts = std::vector<std::string>;

constexpr std::int64_t kSecond = 1'000'000'000;

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(TopicChoice, matchesWholeNamesAndLeavesOutWhatIsExcluded) {
  const TopicChoice choice({"/camera/.*", "/scan"}, {".*/compressed"}, false);
  EXPECT_TRUE(choice.isOpen());
  EXPECT_TRUE(choice.matches("/camera/points"));
  EXPECT_TRUE(choice.matches("/scan"));
  EXPECT_FALSE(choice.matches("/scan_filtered"));
  EXPECT_FALSE(choice.matches("/camera/rgb/compressed"));
  EXPECT_FALSE(TopicChoice({}, {"/a"}, false).isOpen());
}

TEST(TopicChoice, takesAllButClockAndLogs) {
  const TopicChoice choice({}, {"/secret"}, true);
  EXPECT_TRUE(choice.matches("/anything"));
  for (const char* topic : {"/clock", "/rosout", "/rosout_agg", "/secret"}) {
    EXPECT_FALSE(choice.matches(topic)) << topic;
  }
  EXPECT_TRUE(TopicChoice({"/clock"}, {}, true).matches("/clock")) << "who asks for it gets it";
}

TEST(TopicChoice, outlivesNamesOfAnyLength) {
  const std::string longest = "/" + std::string(60'000, 'a');
  EXPECT_TRUE(TopicChoice({"/.*", "(/|a)*"}, {}, false).matches(longest));
  EXPECT_FALSE(TopicChoice({"(/|a|b)*c"}, {}, false).matches(longest));
}

TEST(TopicChoice, doesNotTakeANameThatAnExpressionCannotTellInTime) {
  const std::string name = "/" + std::string(60, 'a') + "!";
  EXPECT_FALSE(TopicChoice({"/(a+)+"}, {}, false).matches(name));
  EXPECT_FALSE(TopicChoice({}, {"/(a+)+"}, true).matches(name)) << "it may be what is excluded";
}

TEST(TopicChoice, quotesAPatternThatIsNone) {
  EXPECT_EQ(
      refusal([] { TopicChoice({"/a("}, {}, false); }).rfind("'/a(' is no regular expression: ", 0),
      0u);
}

TEST(TopicLimit, keepsEachNthMessage) {
  TopicThinner thinner(TopicLimit::parse("/scan every=3"));
  std::vector<std::int64_t> kept;
  for (std::int64_t i = 0; i < 8; ++i) {
    if (thinner.keeps({i})) kept.push_back(i);
  }
  EXPECT_EQ(kept, (std::vector<std::int64_t>{0, 3, 6}));
  EXPECT_EQ(thinner.leftOut(), 5u);
}

TEST(TopicLimit, keepsTheRateThatIsAskedForAndGoesOnAfterSilence) {
  TopicThinner thinner(TopicLimit::parse("/points max_hz=10"));
  int kept = 0;
  for (std::int64_t i = 0; i < 250; ++i) kept += thinner.keeps({i * kSecond / 25}) ? 1 : 0;
  EXPECT_EQ(kept, 100) << "10 s at 25 Hz: every second or third";
  EXPECT_TRUE(thinner.keeps({60 * kSecond}));
  EXPECT_FALSE(thinner.keeps({60 * kSecond + 1})) << "no credit for the silence";
}

TEST(TopicLimit, refusesWhatItDoesNotUnderstand) {
  for (const char* text : {"", "/a", "a every=2", "/a every=0", "/a every=1.5", "/a max_hz=-1",
                           "/a max_hz=nan", "/a at_most=3", "/a every=2 x"}) {
    EXPECT_EQ(refusal([&] { TopicLimit::parse(text); }),
              "limit '" + std::string(text) +
                  "' is not of the form '/TOPIC every=COUNT' or '/TOPIC max_hz=RATE'");
  }
}

TEST(RecordingClock, goesOnWhileBehaviorsRunAndIsTrueAgainWhenNoneDoes) {
  RecordingClock clock;
  EXPECT_EQ(clock.stamp({100 * kSecond}, true).stamp, Stamp{100 * kSecond});
  const auto early = clock.stamp({100 * kSecond - kSecond / 2}, true);
  EXPECT_EQ(early.stamp, Stamp{100 * kSecond}) << "half a second is evened out";
  EXPECT_EQ(early.jump, std::nullopt);
  const auto jumped = clock.stamp({10 * kSecond}, true);
  EXPECT_EQ(jumped.stamp, Stamp{100 * kSecond});
  EXPECT_EQ(jumped.jump,
            "ROS time went back by 90.000 s to 10.000 s; from then on stamps of this recording are "
            "90.000 s ahead of it");
  EXPECT_EQ(clock.stamp({11 * kSecond}, true).stamp, Stamp{101 * kSecond});
  EXPECT_TRUE(clock.endRecording());
  EXPECT_FALSE(clock.endRecording()) << "it was ahead only once";
  EXPECT_EQ(clock.stamp({12 * kSecond}, false).stamp, Stamp{12 * kSecond});
  EXPECT_TRUE(clock.wentBack());
  clock.beginRecording();
  EXPECT_FALSE(clock.wentBack());
  const auto between = clock.stamp({1 * kSecond}, false);
  EXPECT_EQ(between.stamp, Stamp{1 * kSecond});
  EXPECT_EQ(between.jump, "ROS time went back by 11.000 s to 1.000 s");
}

TEST(RecordingClock, isNotMisledByThreadsThatAreHeldUp) {
  RecordingClock clock;
  const std::int64_t day = 86400 * kSecond;
  clock.stamp({100 * kSecond}, true, kSecond);
  EXPECT_EQ(clock.stamp({100 * kSecond}, true, 3 * kSecond).jump, std::nullopt)
      << "two seconds between the two clocks' readings";
  EXPECT_EQ(clock.stamp({103 * kSecond}, true, 4 * kSecond).jump, std::nullopt);
  EXPECT_EQ(clock.stamp({day + 104 * kSecond}, true, 5 * kSecond).stamp, Stamp{104 * kSecond});
  EXPECT_EQ(clock.stamp({105 * kSecond}, true, 6 * kSecond).stamp, Stamp{105 * kSecond})
      << "and set back: a second behind the last one, by the steady clock";
}

TEST(RecordingClock, noticesThatAClockWasSet) {
  RecordingClock watch;
  const auto look = [&](double ros, double wall, double steady, bool is_simulated) {
    const auto ns = [](double s) { return static_cast<std::int64_t>(s * 1e9); };
    return watch.look({{ns(ros)}, {ns(wall)}, ns(steady), is_simulated}).value_or("");
  };
  EXPECT_EQ(look(100, 100, 1, false), "");
  EXPECT_EQ(look(100.4, 100.4, 1.1, false), "") << "less than half a second";
  EXPECT_EQ(look(104.4, 104.4, 1.1, false),
            "the wall clock was set ahead by 4.000 s at 100.400 s of its time");
  EXPECT_EQ(look(101, 101, 1.2, false),
            "the wall clock was set back by 3.500 s at 104.400 s of its time");
  EXPECT_EQ(look(0, 101.1, 1.3, true), "");
  EXPECT_EQ(look(50, 101.2, 1.4, true), "") << "the simulation's first word";
  EXPECT_EQ(look(51.5, 101.3, 1.5, true), "") << "a fast simulation";
  EXPECT_EQ(look(90, 101.4, 1.6, true), "/clock leapt ahead by 38.500 s at 51.500 s");
  EXPECT_EQ(look(90, 106.3, 6.5, true), "") << "a paused simulation";
  EXPECT_EQ(look(90, 106.4, 6.7, true),
            "/clock has stood still for 5 s at 90.000 s: all that comes has this stamp");
  EXPECT_EQ(look(90, 106.5, 6.8, true), "") << "said once";
}

TEST(DiskGuard, warnsBelowFiveTimesTheMinimumAndEndsBelowIt) {
  const std::uint64_t gigabyte = 1u << 30;
  using Level = DiskState::Level;
  EXPECT_EQ(judgeDisk("/d", 5 * gigabyte, gigabyte).level, Level::Ample);
  const DiskState low = judgeDisk("/d", 5 * gigabyte - 1, gigabyte);
  EXPECT_EQ(low.level, Level::Low);
  EXPECT_EQ(low.text, "only 5119 MiB are free below /d, and below 1024 MiB recording ends");
  const DiskState full = judgeDisk("/d", gigabyte - 1, gigabyte);
  EXPECT_EQ(full.level, Level::Full);
  EXPECT_EQ(full.text, "only 1023 MiB are free below /d, less than the 1024 MiB that recording wants");
  EXPECT_EQ(judgeDisk("/d", 0, 0).level, Level::Ample) << "0: no guard";
  EXPECT_GT(freeBytes("/tmp/not/there/yet").value_or(0), 0u);
}

TEST(Snapshot, isWrittenAsItsHeaderSays) {
  EXPECT_EQ(Snapshot().toJson(), "{}");
  Snapshot snapshot;
  snapshot.begin["map->odom"] = {1, 2, 3, 0, 0, 0, 1};
  snapshot.urdf = "ab";
  snapshot.map = "ef";
  snapshot.files["file:///a.wav"] = "cd";
  snapshot.requested = {"/a", "/b"};
  EXPECT_EQ(nlohmann::json::parse(snapshot.toJson()),
            nlohmann::json::parse(R"({"frames": {"begin": {"map->odom": [1, 2, 3, 0, 0, 0, 1]}},
                                      "urdf": "ab", "map": "ef", "files": {"file:///a.wav": "cd"},
                                      "request": {"topics": ["/a", "/b"]}})"));
}

TEST(Snapshot, saysWhatARequestNamedAsFarAsItIsKnown) {
  Behavior behavior;
  EXPECT_EQ(requestedTopics(behavior), std::vector<std::string>()) << "a recording of before";
  for (const char* damaged : {"", "[]", "{", R"({"request": 1})", R"({"request": {"topics": 1}})",
                              R"({"request": {"topics": [1, null]}})"}) {
    behavior.snapshot = damaged;
    EXPECT_EQ(requestedTopics(behavior), std::vector<std::string>()) << damaged;
  }
  Snapshot snapshot;
  snapshot.requested = {"/a", "/b"};
  behavior.snapshot = snapshot.toJson();
  EXPECT_EQ(requestedTopics(behavior), snapshot.requested);
}

TEST(Sha256, isTheOneThatIsPublished) {
  EXPECT_EQ(sha256({'a', 'b', 'c'}),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

// ------------------------------------------------------------------------------- in the recorder

struct RecordingTermsTest : testing::Test {
  static RecorderOptions options() {
    RecorderOptions chosen;
    chosen.batch_period = std::chrono::milliseconds(1);
    chosen.context_topics = {"/tf"};
    chosen.pre_roll = std::chrono::seconds(10);
    return chosen;
  }
  static Behavior behavior(std::int64_t begin, std::vector<std::string> topics = {"/a"}) {
    Behavior made;
    made.name = "pick";
    made.topics = std::move(topics);
    made.begin = {begin};
    made.wall_begin = {begin + 1000 * kSecond};
    return made;
  }
  static RecordingTerms preRoll(std::int64_t seconds) { return {{}, seconds * kSecond}; }
  Texts texts(std::int64_t id) const { return test::readTexts(*store, *store->behavior(id)); }
  std::size_t index(const std::string& topic, bool latching = false) {
    return recorder.channelIndex(stringChannel(topic, "/talker", latching));
  }
  void say(const std::string& topic, std::int64_t at, const std::string& text,
           bool latching = false) {
    recorder.offer(index(topic, latching), {at}, stringBytes(text));
  }
  std::unique_ptr<Store> store = openMemoryStore();
  Recorder recorder{*store, options()};
};

TEST_F(RecordingTermsTest, reachesBackWithTrueStampsAndTheStateOfThen) {
  say("/map", 1 * kSecond, "old map", true);
  say("/a", 2 * kSecond, "too early");
  say("/a", 6 * kSecond, "a");
  say("/other", 6 * kSecond, "not asked for");
  say("/map", 7 * kSecond, "new map", true);
  say("/tf", 8 * kSecond, "tf");
  const Behavior begun = recorder.begin(behavior(10 * kSecond, {"/a", "/map"}), preRoll(5));
  say("/a", 11 * kSecond, "live");
  const RecordedCounts counts = recorder.end(begun.id, {12 * kSecond}, test::outcome("success"));
  EXPECT_EQ(begun.begin, Stamp{5 * kSecond});
  EXPECT_EQ(begun.wall_begin, Stamp{1005 * kSecond});
  EXPECT_EQ(texts(begun.id), (Texts{"old map", "a", "new map", "live"}));
  EXPECT_EQ(counts.stored, 4u);
  const auto messages = test::readAll(*store->messages(*store->behavior(begun.id), {}));
  EXPECT_EQ(messages[1].received, Stamp{6 * kSecond});
  EXPECT_EQ(store->contextTopics(*store->behavior(begun.id)).size(), 1u);
}

TEST_F(RecordingTermsTest, keepsTheTransformsFromBeforeTheBegin) {
  say("/tf", 1 * kSecond, "forgotten");
  say("/tf", 19 * kSecond, "tf");
  say("/a", 19 * kSecond, "before");
  const Behavior begun = recorder.begin(behavior(20 * kSecond));
  say("/tf", 21 * kSecond, "later");
  recorder.end(begun.id, {22 * kSecond}, test::outcome("success"));
  Behavior reaching_back = *store->behavior(begun.id);
  EXPECT_EQ(reaching_back.begin, Stamp{20 * kSecond});
  EXPECT_TRUE(texts(begun.id).empty());
  reaching_back.begin = {10 * kSecond};
  EXPECT_EQ(test::readTexts(*store, reaching_back, {{"/tf"}, {}, {}}), (Texts{"tf", "later"}));
}

TEST_F(RecordingTermsTest, storesWhatTwoBehaviorsReachBackForOnce) {
  say("/a", 1 * kSecond, "1");
  const Behavior first = recorder.begin(behavior(2 * kSecond), preRoll(5));
  say("/a", 3 * kSecond, "2");
  const Behavior second = recorder.begin(behavior(4 * kSecond), preRoll(5));
  recorder.end(second.id, {5 * kSecond}, test::outcome("success"));
  recorder.end(first.id, {5 * kSecond}, test::outcome("success"));
  EXPECT_EQ(texts(first.id), (Texts{"1", "2"}));
  EXPECT_EQ(texts(second.id), (Texts{"1", "2"}));
}

TEST_F(RecordingTermsTest, reachesNoFurtherThanItRemembersWhole) {
  say("/a", 1 * kSecond, "1");
  say("/a", 20 * kSecond, "2");  // 10 s are remembered
  EXPECT_EQ(recorder.begin(behavior(20 * kSecond), preRoll(60)).begin, Stamp{10 * kSecond});
  const Behavior third = recorder.begin(behavior(21 * kSecond));
  EXPECT_EQ(third.begin, Stamp{21 * kSecond}) << "nobody asked for it";
}

TEST_F(RecordingTermsTest, doesNotReachBackIntoWhatWasDiscarded) {
  const Behavior first = recorder.begin(behavior(1 * kSecond));
  say("/a", 2 * kSecond, "of a success");
  recorder.end(first.id, {3 * kSecond}, test::outcome("success"));
  recorder.discard(first.id);
  EXPECT_FALSE(store->behavior(first.id));
  const Behavior second = recorder.begin(behavior(5 * kSecond), preRoll(5));
  EXPECT_GE(second.begin, Stamp{3 * kSecond});
  recorder.end(second.id, {6 * kSecond}, test::outcome("failure"));
  EXPECT_EQ(texts(second.id), Texts{});
}

TEST_F(RecordingTermsTest, thinsOutAndSaysSo) {
  RecordingTerms terms;
  terms.limits = {TopicLimit::parse("/a every=2")};
  const Behavior begun = recorder.begin(behavior(0, {"/a", "/b"}), terms);
  for (int i = 0; i < 6; ++i) {
    say("/a", i, std::to_string(i));
    say("/b", i, "b");
  }
  const RecordedCounts counts = recorder.end(begun.id, {10}, test::outcome("success"));
  EXPECT_EQ(counts.stored, 9u);
  EXPECT_EQ(counts.dropped, 0u);
  EXPECT_EQ(store->behavior(begun.id)->remarks,
            Texts{"3 messages on /a were left out of 6, as asked: every=2"});
}

TEST_F(RecordingTermsTest, letsTopicsJoin) {
  const Behavior begun = recorder.begin(behavior(0));
  say("/late", 1, "unheard");
  recorder.addTopics(begun.id, {"/late", "/a"});
  EXPECT_EQ(store->behavior(begun.id)->topics, (Texts{"/a", "/late"})) << "a crash may come";
  say("/late", 2, "heard");
  recorder.end(begun.id, {3}, test::outcome("success"));
  EXPECT_EQ(texts(begun.id), Texts{"heard"});
}

TEST_F(RecordingTermsTest, keepsTheResultsOfItsGoalsAsContext) {
  const Behavior begun = recorder.begin(behavior(0, {"/arm/goal"}));
  recorder.addTopics(begun.id, {"/head/goal"});
  for (const char* topic : {"/arm/goal", "/arm/result", "/head/result", "/gripper/result"}) {
    say(topic, 1, topic);
  }
  const RecordedCounts counts = recorder.end(begun.id, {3}, test::outcome("success"));
  EXPECT_EQ(texts(begun.id), Texts{"/arm/goal"});
  EXPECT_EQ(counts.silent_topics, Texts{"/head/goal"}) << "a result is nobody's own topic";
  const auto context = store->contextTopics(*store->behavior(begun.id));
  ASSERT_EQ(context.size(), 2u);
  EXPECT_EQ(context[0].topic + " " + context[1].topic, "/arm/result /head/result");
}

TEST_F(RecordingTermsTest, givesATopicThatChangesItsTypeAnotherChannel) {
  Channel changed = stringChannel("/a");
  changed.type = "std_msgs/Empty";
  changed.md5 = "d41d8cd98f00b204e9800998ecf8427e";
  changed.definition = "";
  const Behavior begun = recorder.begin(behavior(0));
  say("/a", 1, "text");
  recorder.offer(recorder.channelIndex(changed), {2}, {});
  recorder.end(begun.id, {3}, test::outcome("success"));
  const auto messages = test::readAll(*store->messages(*store->behavior(begun.id), {}));
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(store->channel(messages[0].channel).type, "std_msgs/String");
  EXPECT_EQ(store->channel(messages[1].channel).md5, changed.md5);
}

TEST_F(RecordingTermsTest, keepsTheOrderOfArrivalWhenTimeGoesBack) {
  const Behavior first = recorder.begin(behavior(100 * kSecond));
  say("/a", 101 * kSecond, "before");
  say("/a", 101 * kSecond - 1000, "a little early");
  say("/a", 1 * kSecond, "after");
  say("/a", 3 * kSecond, "two seconds later");
  const RecordedCounts counts = recorder.end(first.id, {4 * kSecond}, test::outcome("success"));
  EXPECT_EQ(texts(first.id), (Texts{"before", "a little early", "after", "two seconds later"}));
  const Behavior stored = *store->behavior(first.id);
  EXPECT_EQ(stored.end, Stamp{104 * kSecond});
  const Texts expected = {
      "ROS time went back by 100.000 s to 1.000 s; from then on stamps of this recording are "
      "100.000 s ahead of it"};
  EXPECT_EQ(stored.remarks, expected);
  EXPECT_EQ(counts.remarks, expected);
  EXPECT_EQ(recorder.takeNotices(), expected);
  EXPECT_TRUE(recorder.takeNotices().empty());

  const Behavior second = recorder.begin(behavior(5 * kSecond));
  say("/a", 6 * kSecond, "next");
  recorder.end(second.id, {7 * kSecond}, test::outcome("success"));
  EXPECT_EQ(second.begin, Stamp{5 * kSecond}) << "true stamps again";
  EXPECT_NE(second.recording, first.recording);
  EXPECT_EQ(texts(second.id), Texts{"next"});
}

TEST_F(RecordingTermsTest, endsBehindItsLastMessageEvenIfTheClockStandsStill) {
  const Behavior begun = recorder.begin(behavior(5));
  say("/a", 5, "of a simulation that is paused");
  recorder.end(begun.id, {5}, test::outcome("success"));
  EXPECT_EQ(texts(begun.id).size(), 1u);
}

TEST_F(RecordingTermsTest, beginsANewRecordingWhenTimeWentBackBetweenBehaviors) {
  const Behavior first = recorder.begin(behavior(100 * kSecond));
  recorder.end(first.id, {101 * kSecond}, test::outcome("success"));
  recorder.look({{1 * kSecond}, {1 * kSecond}, 0, true});
  const Behavior second = recorder.begin(behavior(2 * kSecond), preRoll(10));
  EXPECT_NE(second.recording, first.recording);
  EXPECT_EQ(second.begin, Stamp{1 * kSecond}) << "not into the time before";
  recorder.end(second.id, {3 * kSecond}, test::outcome("success"));
}

TEST_F(RecordingTermsTest, countsAttemptsOfOneTreePathUnderOneParent) {
  Behavior parent = behavior(0);
  parent.tree_path = "kitting";
  parent.attempt = 0;
  parent = recorder.begin(parent);
  EXPECT_EQ(parent.attempt, 1);
  for (int attempt = 1; attempt <= 2; ++attempt) {
    Behavior child = behavior(attempt * 10);
    child.tree_path = "kitting/pick";
    child.attempt = 0;
    child = recorder.begin(child);
    EXPECT_EQ(child.parent, parent.id);
    EXPECT_EQ(child.attempt, attempt);
    recorder.end(child.id, {attempt * 10 + 5}, test::outcome("failure"));
  }
  Behavior alone = behavior(50);
  alone.attempt = 0;
  EXPECT_EQ(recorder.begin(alone).attempt, 1);
  alone.begin = {60};
  EXPECT_EQ(recorder.begin(alone).attempt, 1) << "no place in a tree: nothing to count";
}

TEST_F(RecordingTermsTest, findsTheFilesThatMessagesReferTo) {
  Channel sounds = stringChannel("/robotsound");
  sounds.type = "sound_play/SoundRequest";
  sounds.definition = "int8 sound\nint8 command\nfloat32 volume\nstring arg\nstring arg2\n";
  const auto request = [](std::uint8_t sound, const std::string& arg, const std::string& arg2) {
    Bytes bytes = {sound, 1, 0, 0, 0, 0};
    for (const std::string& text : {arg, arg2}) {
      const Bytes added = stringBytes(text);
      bytes.insert(bytes.end(), added.begin(), added.end());
    }
    return bytes;
  };
  constexpr std::uint8_t kPlayFile = 0xfe, kSay = 0xfd;
  const std::size_t channel = recorder.channelIndex(sounds);
  const Behavior begun = recorder.begin(behavior(0, {"/robotsound"}));
  const Behavior other = recorder.begin(behavior(0, {"/a"}));
  recorder.offer(channel, {1}, request(kPlayFile, "/sounds/a.wav", ""));
  recorder.offer(channel, {2}, request(kPlayFile, "b.ogg", "speech"));
  recorder.offer(channel, {3}, request(kSay, "Hello", "voice"));
  recorder.offer(channel, {4}, {1, 2});  // no such message
  std::set<std::string> found;
  const auto note = [&](Behavior&, const std::set<std::string>& references) { found = references; };
  recorder.end(begun.id, {5}, note);
  EXPECT_EQ(found, (std::set<std::string>{"file:///sounds/a.wav", "package://speech/b.ogg"}));
  recorder.end(other.id, {5}, note);
  EXPECT_TRUE(found.empty()) << "not its messages";
}

}  // namespace
}  // namespace afterglow::replay::recording_terms_test
