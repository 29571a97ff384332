// `afterglow list`, `show` and `said` asked for something: what they find and how they refuse.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "nodes/tools/program.hpp"
#include "replay/messages/document.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/query_cases.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::query_verbs_test {
namespace {

using namespace afterglow::test;
using Words = std::vector<std::string>;

replay::Channel soundChannel() {
  return {"/robotsound",
          "sound_play/SoundRequest",
          "d098ce4a040686259137ece23a625167",
          "int8 sound\nint8 command\nfloat32 volume\nstring arg\nstring arg2\n",
          false,
          "/speaker"};
}

replay::Bytes soundBytes(int sound, int command, const std::string& text) {
  const replay::Channel channel = soundChannel();
  return replay::encode(replay::Schema::parse(channel.type, channel.definition),
                        replay::Object{{"sound", static_cast<std::int8_t>(sound)},
                                       {"command", static_cast<std::int8_t>(command)},
                                       {"volume", 1.0F},
                                       {"arg", text},
                                       {"arg2", std::string()}});
}

class QueryVerbs : public testing::Test {
 protected:
  void SetUp() override {
    const auto store = replay::openStore(path_, replay::OpenMode::ReadWrite);
    fillQueryStore(*store);  // from 1970 on, second by second
    const auto recording = store->addRecording({0, "", "speech", ""});
    const auto channel = store->addChannel(recording, soundChannel());
    const auto say = [&](std::int64_t second, int sound, int command, const std::string& text) {
      store->append(
          {{channel, replay::Stamp{second * 1'000'000'000}, static_cast<std::uint64_t>(second),
            std::nullopt, soundBytes(sound, command, text)}});
    };
    say(100, -3, 1, "Good morning");
    say(101, -2, 1, "/sounds/beep.ogg");
    say(102, -1, 0, "");
    say(110, -3, 1, "Picking");
    say(111, 2, 1, "");
    say(130, -3, 1, "Good night");
    auto outer = sampleBehavior(recording, {"/robotsound"}, 99'000'000'000, 131'000'000'000);
    outer.name = "day";
    store->addBehavior(outer);
    auto inner = sampleBehavior(recording, {}, 109'000'000'000, 112'000'000'000);
    inner.name = "work";
    store->addBehavior(inner);
  }

  ProgramResult run(Words arguments) const {
    arguments.insert(arguments.begin(), AFTERGLOW_TEST_COMMAND);
    arguments.insert(arguments.end(), {"--store", path_});
    return runProgram(arguments);
  }
  Words names(Words arguments) const {
    arguments.insert(arguments.begin(), {"list", "--json"});
    const ProgramResult result = run(arguments);
    Words found;
    const auto list = nlohmann::json::parse(result.output, nullptr, false);
    if (!list.is_array()) return {result.output};
    for (const auto& behavior : list) found.push_back(behavior["name"]);
    return found;
  }
  Words said(Words arguments) const {
    arguments.insert(arguments.begin(), {"said", "--json"});
    Words texts;
    for (const auto& each : nlohmann::json::parse(run(arguments).output)) {
      texts.push_back(each["text"].is_null() ? each["file"] : each["text"]);
    }
    return texts;
  }
  void expectRefused(const Words& arguments, const std::string& text) const {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(result.output, "afterglow " + arguments.front() + ": " + text + "\n");
  }

  TempFolder folder_;
  std::string path_ = folder_.path("store.db");
};

TEST_F(QueryVerbs, listFiltersByFieldsMessagesRobotAndTag) {
  EXPECT_EQ(names({"--where", R"({"/cmd_vel": {"linear.x": {"$gt": 0.5}}})"}),
            (Words{"drive", "pick blue"}));
  EXPECT_EQ(names({"--robot", "fetch8"}), Words{"place"});
  EXPECT_EQ(names({"--tag", "grasp"}), Words{"pick blue"});
  EXPECT_EQ(names({"--limit", "2"}), (Words{"work", "day"}));
  EXPECT_EQ(names({"--last", "--where", R"({"name": {"$regex": "pick"}})"}), Words{"pick blue"});
  EXPECT_EQ(names({"--before", "pick blue"}), Words{"pick red"});
  EXPECT_EQ(names({"--before", "2", "--until", "now"}), Words{"pick red"});
  EXPECT_EQ(names({"--before", "1970-01-01T00:00:05Z"}), Words{"pick red"});
  EXPECT_TRUE(names({"--since", "10 minutes ago"}).empty());
}

TEST_F(QueryVerbs, listExplains) {
  const std::string text =
      run({"list", "--explain", "--where", R"({"name": "place", "/said": {"data": "x"}})"}).output;
  EXPECT_EQ(text, "behaviors: index by name, 1 of 7\nfilter: 0 of 1 match; messages read: 1\n");
}

TEST_F(QueryVerbs, refuseInOneLine) {
  expectRefused({"list", "--where", R"({"outcom": "x"})"},
                "filter, at outcom: behaviors have no field outcom; did you mean outcome?");
  expectRefused({"show", "pick"},
                "sqlite:" + path_ + ": \"pick\" could be any of: pick blue, pick red");
  expectRefused({"show", "the", "last", "failed", "place"},
                "sqlite:" + path_ +
                    ": there is no \"the last failed place\": the store has no behavior "
                    "\"place\" with outcome failure");
  EXPECT_EQ(run({"list", "--since", "gestern"}).status, 2);
  EXPECT_NE(run({"list", "--since", "gestern"}).output.find("yesterday 14:00"), std::string::npos);
}

TEST_F(QueryVerbs, listTellsAnEmptyStoreFromAFilterThatFindsNone) {
  EXPECT_EQ(run({"list", "--name", "none"}).output,
            "no such behaviors in sqlite:" + path_ + "; none has the name \"none\"\n");
  const std::string empty = folder_.path("empty.db");
  replay::openStore(empty, replay::OpenMode::ReadWrite);
  EXPECT_EQ(runProgram({AFTERGLOW_TEST_COMMAND, "list", "--store", empty}).output,
            "no behaviors yet in sqlite:" + empty + "\n");
}

TEST_F(QueryVerbs, listNamesWhatIsNearToAWordThatNoBehaviorHas) {
  EXPECT_EQ(run({"list", "--name", "plce", "--outcome", "sucess", "--topic", "/siad"}).output,
            "no such behaviors in sqlite:" + path_ +
                "; none has the name \"plce\"; did you mean place?; none has the outcome "
                "\"sucess\"; did you mean success?; none has the topic \"/siad\"; did you mean "
                "/said?\n");
}

TEST_F(QueryVerbs, infoTellsWhatAFileOrABehaviorHolds) {
  const std::string bag = folder_.path("place.bag");
  ASSERT_EQ(run({"export", "place", "--out", bag}).status, 0);
  const std::string text = runProgram({AFTERGLOW_TEST_COMMAND, "info", bag}).output;
  EXPECT_EQ(text.rfind(bag + "\n  size        ", 0), 0u) << text;
  EXPECT_NE(text.find("\n  /said     std_msgs/String "), std::string::npos) << text;
  EXPECT_EQ(run({"info", "place"}).output, run({"show", "place"}).output);
  const ProgramResult gone = runProgram({AFTERGLOW_TEST_COMMAND, "info", "gone.bag"});
  EXPECT_EQ(gone.status, 1);
  EXPECT_NE(gone.output.find("gone.bag"), std::string::npos) << gone.output;
}

TEST_F(QueryVerbs, helpOfAVerbIsItsHelp) {
  EXPECT_EQ(runProgram({AFTERGLOW_TEST_COMMAND, "help", "store", "check"}).output,
            runProgram({AFTERGLOW_TEST_COMMAND, "store", "check", "--help"}).output);
}

TEST_F(QueryVerbs, areNamedToWhoMisspellsThem) {
  const auto said = [](const Words& words) {
    Words all = {AFTERGLOW_TEST_COMMAND};
    all.insert(all.end(), words.begin(), words.end());
    return runProgram(all).output;
  };
  EXPECT_EQ(said({"lst"}), "afterglow: there is no verb 'lst'; did you mean list?\n");
  EXPECT_EQ(said({"store", "chek"}),
            "afterglow store: there is no subcommand 'chek'; did you mean check?; see --help\n");
  EXPECT_EQ(
      said({"store"}),
      "afterglow store: a subcommand is missing; there are: check repair compact stats prune; "
      "see --help\n");
}

TEST_F(QueryVerbs, areNamedToWhoAsksForAnother) {
  const ProgramResult result = runProgram({AFTERGLOW_TEST_COMMAND, "foo"});
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.output.rfind("afterglow: there is no verb 'foo'; there are: import", 0), 0u)
      << result.output;
}

TEST_F(QueryVerbs, listShowsTheOthersBesideADamagedRow) {
  {
    const auto store = replay::openStore(path_, replay::OpenMode::ReadWrite);
    auto behavior = sampleBehavior(1, {}, 200'000'000'000, 201'000'000'000);
    behavior.name = "damaged";
    behavior.parameters = R"({"mark": "unhurt"})";
    store->addBehavior(behavior);
  }
  std::string bytes = fileBytes(path_);
  const std::string mark = "\"unhurt\"}";
  for (auto at = bytes.find(mark); at != std::string::npos; at = bytes.find(mark)) {
    bytes[at + mark.size() - 1] = ']';
  }
  writeFile(path_, bytes);
  const ProgramResult listed = run({"list", "--json"});
  EXPECT_EQ(listed.status, 0);
  EXPECT_NE(listed.output.find("its parameters are no JSON"), std::string::npos) << listed.output;
  EXPECT_NE(listed.output.find("\"parameters\": null"), std::string::npos);
  EXPECT_NE(listed.output.find("\"pick blue\""), std::string::npos);
}

TEST_F(QueryVerbs, tellATerminalNoneOfTheEscapeSequencesInAName) {
  {
    const auto store = replay::openStore(path_, replay::OpenMode::ReadWrite);
    auto behavior = sampleBehavior(1, {}, 200'000'000'000, 201'000'000'000);
    behavior.name = "pick\x1b]0;owned\x07\xc2\x9b" "31m gr\xc3\xbcn\nlast";
    store->addBehavior(behavior);
  }
  for (const Words& words : {Words{"list"}, Words{"list", "--json"}, Words{"show", "last"}}) {
    const std::string output = run(words).output;
    for (const char* hostile : {"\x1b", "\x07", "\xc2\x9b"}) {
      EXPECT_EQ(output.find(hostile), std::string::npos) << words.front() << ": " << output;
    }
    EXPECT_NE(output.find("gr\xc3\xbcn"), std::string::npos) << output;
  }
  const std::string name = "pick\\u001b]0;owned\\u0007\\u009b31m gr\xc3\xbcn\\u000alast";
  EXPECT_NE(run({"list"}).output.find(name), std::string::npos) << run({"list"}).output;
}

TEST_F(QueryVerbs, showLeavesTheWholeOfALongCalibrationToJson) {
  {
    const auto store = replay::openStore(path_, replay::OpenMode::ReadWrite);
    auto behavior = sampleBehavior(1, {}, 200'000'000'000, 201'000'000'000);
    behavior.calibration = R"({"camera_info": ")" + std::string(300, 'K') + R"("})";
    store->addBehavior(behavior);
  }
  const std::string output = run({"show", "last"}).output;
  const auto begin = output.find("calibration {\"camera_info\": \"KKK");
  ASSERT_NE(begin, std::string::npos) << output;
  const std::string line = output.substr(begin, output.find('\n', begin) - begin);
  EXPECT_LT(line.size(), 170u) << line;
  EXPECT_NE(line.find("(all of it: --json)"), std::string::npos) << line;
}

TEST_F(QueryVerbs, showSelectsByWordsAndFiltersMessages) {
  EXPECT_EQ(run({"show", "last", "failure"}).output.substr(0, 22), "behavior 2 \"pick blue\"");
  const auto count = [&](Words more) {
    more.insert(more.begin(), {"show", "pick blue", "--messages", "--topic", "/cmd_vel"});
    const std::string output = run(more).output;
    return std::count(output.begin(), output.end(), '\n');
  };
  EXPECT_EQ(count({}), 3);
  EXPECT_EQ(count({"--where", R"({"linear.x": {"$gt": 0}})"}), 2);
  const std::string last =
      run({"show", "2", "--messages", "--topic", "/cmd_vel", "--last", "1"}).output;
  EXPECT_EQ(nlohmann::json::parse(last)["message"]["linear"]["x"], -0.4);
}

TEST_F(QueryVerbs, saidTellsWhatWasSaid) {
  EXPECT_EQ(said({}), (Words{"Good night", "Picking", "/sounds/beep.ogg", "Good morning"}));
  EXPECT_EQ(said({"--before", "work"}), (Words{"/sounds/beep.ogg", "Good morning"}));
  EXPECT_EQ(said({"--limit", "1", "--before", "1970-01-01T00:02:00Z"}), Words{"Picking"});
  const auto list = nlohmann::json::parse(run({"said", "--json"}).output);
  EXPECT_EQ(list[1]["name"], "work") << "the inner behavior said it";
  EXPECT_NE(run({"said"}).output.find("1970-01-01T00:01:41.000Z   6  day       plays /sounds/beep"),
            std::string::npos)
      << run({"said"}).output;
}

}  // namespace
}  // namespace afterglow::nodes::query_verbs_test
