// `afterglow store` and `afterglow sync`: what they print and how they exit.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <filesystem>

#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::store_verb_test {
namespace {

using namespace afterglow::test;
using replay::OpenMode;
using replay::Stamp;

struct Outcome {
  int status = -1;
  std::string output;  ///< of both kinds
};

/// A store with three behaviors of one message each, which ended long ago.
class StoreVerb : public testing::Test {
 protected:
  void SetUp() override {
    const auto store = replay::openStore(path_, OpenMode::ReadWrite);
    const auto recording = store->addRecording({0, "", "/recorder", ""});
    const auto channel = store->addChannel(recording, stringChannel("/a"));
    for (std::int64_t i = 0; i < 3; ++i) {
      store->append({stringMessage(channel, 10 * i, static_cast<std::uint64_t>(i), "hello")});
      auto behavior = sampleBehavior(recording, {"/a"}, 10 * i, 10 * i + 10);
      if (i == 1) behavior.tags = {"demo"};
      store->addBehavior(behavior);
    }
  }

  Outcome run(const std::string& arguments) {
    return runVerb("store " + arguments + " --store " + path_);
  }

  Outcome runVerb(const std::string& arguments) {
    const std::string command = std::string(AFTERGLOW_TEST_COMMAND) + " " + arguments + " 2>&1";
    FILE* pipe = popen(command.c_str(), "r");
    if (!pipe) return {};
    Outcome outcome;
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) {
      outcome.output += static_cast<char>(c);
    }
    outcome.status = WEXITSTATUS(pclose(pipe));
    return outcome;
  }

  /// Behind the store's back.
  void damageFirstMessage() {
    std::string bytes = fileBytes(path_);
    const auto at = bytes.find("hello");
    ASSERT_NE(at, std::string::npos);
    bytes[at] = 'j';
    writeFile(path_, bytes);
  }

  TempFolder folder_;
  std::string path_ = folder_.path("store.db");
};

TEST_F(StoreVerb, editChangesWhatListAndShowTell) {
  const std::string store = " --store " + path_;
  const Outcome edited =
      runVerb("edit 1 --rename grasp --tag shown --outcome failure --note 'it slipped'" + store);
  EXPECT_EQ(edited.status, 0) << edited.output;
  const Outcome shown = runVerb("show grasp" + store);
  for (const char* text : {"behavior 1 \"grasp\"", "failure", "shown", "it slipped"}) {
    EXPECT_NE(shown.output.find(text), std::string::npos) << shown.output;
  }
}

TEST_F(StoreVerb, editDeletesOnlyWhatItWasToldTo) {
  const std::string store = " --store " + path_ + " < /dev/null";
  const Outcome asked = runVerb("edit 1 --delete" + store);
  EXPECT_EQ(asked.status, 1);
  EXPECT_NE(asked.output.find("Say so with --yes"), std::string::npos) << asked.output;
  EXPECT_EQ(runVerb("edit 1 --delete --yes" + store).status, 0);
  EXPECT_EQ(runVerb("show 1" + store).status, 1);
  EXPECT_EQ(runVerb("show 2" + store).status, 0);
  EXPECT_EQ(runVerb("edit 2" + store).status, 2) << "no change is named";
  EXPECT_EQ(runVerb("edit 2 --trim 1" + store).status, 2);
  EXPECT_EQ(runVerb("edit 2 --trim 0:3 --yes" + store).status, 1) << "it takes 10 ns";
}

TEST_F(StoreVerb, sayThatDamagedMessagesAreLeftOut) {
  for (std::int64_t i = 0; i < 2; ++i) damageFirstMessage();
  const std::string told =
      "2 damaged messages are left out; afterglow store check names what is damaged\n";
  const std::string store = " --store " + path_;
  const Outcome shown = runVerb("show 3 --messages" + store);
  EXPECT_EQ(shown.output, "1 damaged message is" + told.substr(22));
  const Outcome exported = runVerb("export 2 3 --out " + folder_.path("a.bag") + store);
  EXPECT_NE(exported.output.find("0 messages of"), std::string::npos) << exported.output;
  EXPECT_NE(exported.output.find(told), std::string::npos) << exported.output;
}

TEST_F(StoreVerb, checksAndRepairs) {
  const Outcome whole = run("check");
  EXPECT_EQ(whole.output, "sqlite:" + path_ + ": 3 messages, all is well\n");
  EXPECT_EQ(whole.status, 0);
  damageFirstMessage();
  const Outcome damaged = run("check");
  EXPECT_NE(damaged.output.find("recording 1, /a: a message is damaged, of 1970-01-01T00:00:00.000Z"
                                ": the checksum is another\n"),
            std::string::npos)
      << damaged.output;
  EXPECT_EQ(damaged.status, 1);
  const Outcome repaired = run("repair");
  EXPECT_NE(repaired.output.find("2 messages kept; the store as it was is now " + path_ +
                                 ".damaged\nlost: recording 1, /a: a message is lost"),
            std::string::npos)
      << repaired.output;
  EXPECT_EQ(repaired.status, 1) << "something is lost";
  EXPECT_EQ(run("check").status, 0);
}

TEST_F(StoreVerb, prunesAndSaysWhat) {
  EXPECT_EQ(run("prune").status, 2);
  EXPECT_EQ(run("prune --older-than soon").status, 2);
  const Outcome dry = run("prune --older-than 30d --keep-tag demo --dry-run");
  EXPECT_EQ(dry.output,
            "1  1970-01-01T00:00:00.000Z  pick\n3  1970-01-01T00:00:00.000Z  pick\n"
            "2 behaviors would be removed\n");
  EXPECT_EQ(run("prune --older-than 30d --keep-tag demo").status, 0);
  EXPECT_EQ(replay::openStore(path_, OpenMode::ReadOnly)->behaviors({}).size(), 1u);
  EXPECT_EQ(run("prune --larger-than 10G").output, "0 behaviors removed\n");
}

TEST_F(StoreVerb, namesWhatIsNearToAWordThatNoBehaviorHas) {
  const Outcome dry = run("prune --older-than 30d --keep-tag domo --dry-run");
  EXPECT_EQ(dry.output.rfind(
                "--keep-tag keeps nothing: none has the tag \"domo\"; did you mean demo?\n", 0),
            0u)
      << dry.output;
  const Outcome none =
      runVerb("sync --from " + path_ + " --to " + folder_.path("b.db") + " --name pikc");
  EXPECT_NE(
      none.output.find("of sqlite:" + path_ + ", none has the name \"pikc\"; did you mean pick?\n"),
      std::string::npos)
      << none.output;
}

TEST_F(StoreVerb, measuresForPeopleAndPrograms) {
  const Outcome table = run("stats");
  EXPECT_NE(table.output.find("1 recording, 3 behaviors, 3 messages, 0 files"), std::string::npos)
      << table.output;
  EXPECT_NE(table.output.find("/a"), std::string::npos);
  const Outcome json = run("stats --json");
  EXPECT_NE(json.output.find("\"messages\": 3"), std::string::npos) << json.output;
  EXPECT_NE(json.output.find("\"recorder\": null"), std::string::npos);
  EXPECT_EQ(run("compact").status, 0);
}

TEST_F(StoreVerb, makesNoStoreThatIsNotThere) {
  path_ = folder_.path("none.db");
  for (const char* verb : {"check", "repair", "compact", "stats", "prune --older-than 1d"}) {
    const Outcome refused = run(verb);
    EXPECT_EQ(refused.status, 1) << verb;
    EXPECT_NE(refused.output.find("sqlite:" + path_ + ": no such store"), std::string::npos)
        << refused.output;
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_FALSE(std::filesystem::exists(path_ + ".lock"));
}

TEST_F(StoreVerb, syncCopiesWhatTheOtherStoreLacks) {
  const std::string sync = "sync --from " + path_ + " --to " + folder_.path("fleet.db");
  EXPECT_EQ(runVerb(sync + " --tag demo").output.find("1 behaviors copied (1 messages, 0 files)"),
            0u);
  const Outcome rest = runVerb(sync + R"( --where '{"/a": {"data": "hello"}}')");
  EXPECT_EQ(rest.status, 0) << rest.output;
  EXPECT_NE(rest.output.find("2 behaviors copied"), std::string::npos) << rest.output;
  EXPECT_NE(rest.output.find("1 there already"), std::string::npos) << rest.output;
  EXPECT_EQ(replay::openStore(folder_.path("fleet.db"), OpenMode::ReadOnly)->behaviors({}).size(),
            3u);
}

TEST_F(StoreVerb, syncSaysWhatWasWrong) {
  const Outcome same = runVerb("sync --from " + path_ + " --to " + path_);
  EXPECT_EQ(same.status, 2) << same.output;
  const Outcome nowhere = runVerb("sync --from " + path_ + " --to ftp://x/y");
  EXPECT_EQ(nowhere.status, 1);
  EXPECT_NE(nowhere.output.find("no store of the kind \"ftp\""), std::string::npos)
      << nowhere.output;
}

}  // namespace
}  // namespace afterglow::nodes::store_verb_test
