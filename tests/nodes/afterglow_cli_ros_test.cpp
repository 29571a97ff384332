// The command, as a user meets it: import, list, show, export. Judge of bags: rosbag's Python
// reader (tests/support/bag_judge.py).
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "nodes/tools/program.hpp"
#include "tests/support/own_server.hpp"
#include "tests/support/real_data.hpp"
#include "tests/support/session_bag.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::afterglow_cli_ros_test {
namespace {

namespace fs = std::filesystem;
using namespace afterglow::test;

/// A bag of two robots' session on nine topics, and what is in it.
struct Session {
  std::string bag, name;
  int messages, still_messages;    ///< of all topics; of /rosout and /tf_static
  std::int64_t begin_ns, last_ns;  ///< stamps
  std::string pose_topic, pose_type;
  int poses;
  std::string shown_line;  ///< type, count and rate of a topic as `show` has them
  std::string command_topic;
  double command_hz;
  std::string excess;  ///< the refusal of its greatest velocity where 0.5 m/s are allowed
};

Session realSession() {
  return {realData("turtlesim.bag"),
          "turtlesim",
          8647,
          11,
          1396293887844783943,
          1396293909544870199,
          "/turtle1/pose",
          "turtlesim/Pose",
          1344,
          "turtlesim/Color          1351   62.50",
          "/turtle1/cmd_vel",
          21.4,
          "/turtle1/cmd_vel: linear velocity of 2 m/s at rate 1, 17.54 s into the behavior, "
          "is above the limit of 0.5"};
}

Session generatedSession(const std::string& bag) {
  SessionBag::write(bag);
  return {bag,
          fs::path(bag).stem(),
          3859,
          8,
          SessionBag::kBegin,
          SessionBag::kLast,
          "/wader1/pose",
          "pond/Pose",
          600,
          "pond/Ripple               601   49.62",
          "/wader1/cmd_vel",
          20.0,
          "/wader1/cmd_vel: linear velocity of 1.5 m/s at rate 1, 6.5 s into the behavior, "
          "is above the limit of 0.5"};
}

/// "2014-03-31T19:25:09Z"
std::string dateText(double seconds) {
  const auto time = static_cast<std::time_t>(seconds);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&time));
  return text;
}

/// A folder of its own, with the store of all commands in it.
class AfterglowCommand : public testing::Test {
 protected:
  void SetUp() override { setenv("AFTERGLOW_STORE", store_.c_str(), 1); }

  ProgramResult afterglow(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), AFTERGLOW_TEST_COMMAND);
    return runProgram(arguments);
  }
  ProgramResult judge(const std::string& script) const {
    return runProgram({"bash", "-c", "set -o pipefail; " + script, "judge", AFTERGLOW_TEST_PYTHON,
                       AFTERGLOW_TEST_COMMAND});
  }
  /// Refused: status 1 and one line on stderr that says this.
  void expectRefused(const std::vector<std::string>& arguments, const std::string& text) const {
    const ProgramResult result = afterglow(arguments);
    EXPECT_EQ(result.status, 1) << result.output;
    EXPECT_EQ(result.output, "afterglow " + arguments.front() + ": " + text + "\n");
  }

  TempFolder folder_;
  std::string store_ = folder_.path("data/store.db");
};

/// The same with a session imported.
class ImportedSession : public AfterglowCommand, public testing::WithParamInterface<Source> {
 protected:
  void SetUp() override {
    AfterglowCommand::SetUp();
    session_ = GetParam() == Source::Real ? realSession()
                                          : generatedSession(folder_.path("two waders.bag"));
    imported_ = afterglow({"import", session_.bag, "--tag", "real", "--tag", "old"});
    ASSERT_EQ(imported_.status, 0) << imported_.output;
  }
  /// `times` all its messages, as a number.
  std::string messages(int times = 1) const { return std::to_string(times * session_.messages); }
  /// What export says first.
  std::string exported() const {
    return messages() + " messages of behavior 1 \"" + session_.name + "\" in ";
  }
  void expectSame(const std::string& bag) const {
    const ProgramResult same = judge("\"$1\" tests/support/bag_judge.py same \"" + session_.bag +
                                     "\" \"" + bag + "\"");
    EXPECT_EQ(same.output, messages() + " messages are the same\n");
  }

  Session session_;
  ProgramResult imported_;
};

TEST_P(ImportedSession, isCounted) {
  EXPECT_EQ(imported_.output, messages() + " messages on 9 topics as behavior 1 \"" +
                                  session_.name + "\" in sqlite:" + store_ + "\n");
  const auto list = nlohmann::json::parse(afterglow({"list", "--json"}).output);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0]["id"], 1);
  EXPECT_EQ(list[0]["name"], session_.name);
  EXPECT_EQ(list[0]["tree_path"], "");
  EXPECT_EQ(list[0]["outcome"], "imported");
  EXPECT_EQ(list[0]["begin_ns"], std::to_string(session_.begin_ns));
  EXPECT_EQ(list[0]["end_ns"], std::to_string(session_.last_ns + 1));
  EXPECT_EQ(list[0]["tags"], (std::vector<std::string>{"real", "old"}));
  EXPECT_EQ(list[0]["topics"].size(), 9u);
  EXPECT_EQ(list[0]["topics"][session_.pose_topic],
            (nlohmann::json{{"type", session_.pose_type}, {"count", session_.poses}}));
}

TEST_P(ImportedSession, hasTheValuesThatRosbagReads) {
  const ProgramResult result =
      judge(R"("$2" show 1 --messages | "$1" tests/support/bag_judge.py values ")" +
            session_.bag + "\"");
  EXPECT_EQ(result.output, messages() + " messages have the same values\n");
  EXPECT_EQ(result.status, 0);
}

TEST_P(ImportedSession, isExportedByteForByte) {
  const std::string bag = folder_.path("out.bag");
  EXPECT_EQ(afterglow({"export", "1", "--out", bag}).output, exported() + bag + "\n");
  expectSame(bag);
  const ProgramResult info = runProgram({"rosbag", "info", bag});
  EXPECT_EQ(info.status, 0) << info.output;
  EXPECT_NE(info.output.find("messages:    " + messages()), std::string::npos) << info.output;
}

TEST_P(ImportedSession, isExportedByTopic) {
  const std::string bag = folder_.path("out.bag");
  EXPECT_EQ(afterglow({"export", "1", "--out", bag, "--topics", "/tf_static,/rosout"}).output,
            std::to_string(session_.still_messages) + " messages of behavior 1 \"" +
                session_.name + "\" in " + bag + "\n");
  fs::remove(bag);
  expectRefused({"export", "1", "--out", bag, "--topics", "/none"},
                "behavior 1 holds no messages on its topics: /none");
  EXPECT_FALSE(fs::exists(bag));
}

TEST_P(ImportedSession, isExportedTogetherAndCompressed) {
  EXPECT_EQ(
      afterglow({"import", "--as-one", "--name", "twice", session_.bag, session_.bag}).output,
      messages(2) + " messages on 9 topics as behavior 2 \"twice\" in sqlite:" + store_ + "\n");
  const std::string bag = folder_.path("out.bag");
  EXPECT_EQ(afterglow({"export", "1", "2", "--out", bag, "--compression", "bz2"}).output,
            messages(3) + " messages of behaviors 1 \"" + session_.name + "\", 2 \"twice\" in " +
                bag + "\n");
  EXPECT_EQ(
      afterglow({"export", "1", "--out", bag, "--compression", "lz4", "--split-size", "1"}).output,
      exported() + folder_.path("out_0.bag") + "\n");
  expectSame(folder_.path("out_0.bag"));
  const std::string mcap = folder_.path("out.mcap");
  EXPECT_EQ(afterglow({"export", "1", "--out", mcap}).output, exported() + mcap + "\n");
  EXPECT_EQ(afterglow({"import", mcap}).output,
            messages(1) + " messages on 9 topics as behavior 3 \"out\" in sqlite:" + store_ + "\n");
  EXPECT_EQ(afterglow({"export", "3", "--out", bag}).status, 0);
  expectSame(bag);
  expectRefused({"export", "1", "--out", "x.db3"},
                "x.db3: bags of ROS 2 are not written; FILE.bag and FILE.mcap are");
}

TEST_P(ImportedSession, isFoundByNameTopicAndTime) {
  ASSERT_EQ(afterglow({"import", session_.bag, "--name", "they, again"}).status, 0);
  const auto found = [&](std::vector<std::string> filter) {
    filter.insert(filter.begin(), {"list", "--json"});
    return nlohmann::json::parse(afterglow(filter).output).size();
  };
  EXPECT_EQ(found({}), 2u);
  EXPECT_EQ(found({"--name", "they, again"}), 1u);
  EXPECT_EQ(found({"--name", "nobody"}), 0u);
  EXPECT_EQ(found({"--outcome", "imported"}), 2u);
  EXPECT_EQ(found({"--topic", "/tf"}), 2u);
  EXPECT_EQ(found({"--topic", "/tfx"}), 0u);
  const double begin = static_cast<double>(session_.begin_ns) * 1e-9;
  const double last = static_cast<double>(session_.last_ns) * 1e-9;
  EXPECT_EQ(found({"--since", dateText(std::floor(last)), "--until",
                   std::to_string(static_cast<std::int64_t>(std::ceil(begin)))}),
            2u);
  EXPECT_EQ(found({"--since", dateText(std::ceil(last))}), 0u);
  EXPECT_EQ(found({"--until", dateText(std::floor(begin))}), 0u);
}

TEST_P(ImportedSession, isShownWithItsTopics) {
  const std::string text = afterglow({"show", "1"}).output;
  EXPECT_NE(text.find("behavior 1 \"" + session_.name + "\""), std::string::npos) << text;
  EXPECT_NE(text.find(session_.shown_line), std::string::npos) << text;
  const auto json = nlohmann::json::parse(afterglow({"show", "1", "--json"}).output);
  EXPECT_EQ(json["topic_details"].size(), 9u);
  EXPECT_EQ(json["topic_details"][3]["topic"], session_.command_topic);
  EXPECT_NEAR(json["topic_details"][3]["hz"].get<double>(), session_.command_hz, 0.1);
}

TEST_P(ImportedSession, isNotMovedFasterThanGivenLimits) {
  const std::string limits = folder_.path("limits.yaml");
  writeFile(limits, "linear_velocity: 0.5\n");
  expectRefused({"play", "1", "--limits", limits, "--dry-run"}, session_.excess);
  EXPECT_EQ(afterglow({"play", "1", "--limits", limits, "--dry-run", "--only", "ar"}).status, 0);
}

TEST_P(ImportedSession, isShownMessageByMessage) {
  const ProgramResult result =
      afterglow({"show", "1", "--messages", "--topic", "/tf_static", "--limit", "5"});
  const auto line = nlohmann::json::parse(result.output);
  EXPECT_EQ(line["type"], "tf2_msgs/TFMessage");
  EXPECT_TRUE(line["message"]["transforms"].is_array());
}

// ------------------------------------------------------------------------------------- rosbag play

TEST_P(ImportedSession, isPlayedByRosbag) {
  const std::string bag = folder_.path("out.bag");
  ASSERT_EQ(afterglow({"export", "1", "--out", bag}).status, 0);
  const int port = freePort();
  const OwnServer master({"roscore", "-p", std::to_string(port)}, port, SIGINT);
  setenv("ROS_MASTER_URI", ("http://localhost:" + std::to_string(port)).c_str(), 1);
  const ProgramResult played = runProgram({"rosbag", "play", "--quiet", "--immediate", bag});
  EXPECT_EQ(played.status, 0) << played.output;
}

// -------------------------------------------------------------------------------------- bad input

TEST_P(ImportedSession, staysAsItIsWhenAnImportFails) {
  const std::string before = afterglow({"list", "--json"}).output;
  const std::string whole = fileBytes(session_.bag);
  const std::string cut = folder_.path("cut.bag");
  for (const std::size_t size :
       {0ul, 5ul, 13ul, 100ul, 4117ul, whole.size() / 2, whole.size() - 2000, whole.size() - 1}) {
    writeFile(cut, whole.substr(0, size));
    const ProgramResult result = afterglow({"import", cut});
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(result.output.find("afterglow import: " + cut + ": "), 0u) << result.output;
    EXPECT_EQ(result.output.find('\n'), result.output.size() - 1) << result.output;
  }
  EXPECT_EQ(afterglow({"list", "--json"}).output, before);
}

TEST_F(AfterglowCommand, leavesNoStoreBehindWhenTheFirstImportFails) {
  writeFile(folder_.path("text.bag"), "no bag at all, whatever it is called");
  expectRefused({"import", folder_.path("text.bag")}, folder_.path("text.bag") + ": not a bag");
  EXPECT_FALSE(fs::exists(store_));
  EXPECT_FALSE(fs::exists(folder_.path("data"))) << "nor the folder made for it";
}

TEST_F(AfterglowCommand, saysInOneLineWhatIsWrong) {
  expectRefused({"list"}, "sqlite:" + store_ + ": no such store");
  writeFile(folder_.path("empty"), "");
  expectRefused({"list", "--store", folder_.path("empty")},
                "sqlite:" + folder_.path("empty") + ": not an Afterglow store: the file is empty");
  writeFile(folder_.path("text"), std::string(200, 'x'));
  expectRefused({"show", "1", "--store", folder_.path("text")},
                "sqlite:" + folder_.path("text") +
                    ": not an Afterglow store: the file is no SQLite database");
  expectRefused({"import", folder_.path("none.bag")},
                folder_.path("none.bag") + ": cannot open: No such file or directory");
}

TEST_P(ImportedSession, isNotConfusedWithOthers) {
  expectRefused({"show", "2"}, "sqlite:" + store_ + ": there is no behavior 2");
  expectRefused({"export", "2", "--out", folder_.path("x.bag")},
                "sqlite:" + store_ + ": there is no behavior 2");
  const std::string out = folder_.path("none/x.bag");
  expectRefused({"export", "1", "--out", out},
                out + ": cannot write the bag: No such file or directory");
}

INSTANTIATE_TEST_SUITE_P(On, ImportedSession, sources(), sourceName);

TEST_F(AfterglowCommand, endsWithTwoForWrongUsage) {
  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{},
                                             {"lisst"},
                                             {"import"},
                                             {"show"},
                                             {"show", "1", "--topic", "/a"},
                                             {"export", "1"},
                                             {"export", "1", "--out", "a", "--compression", "zip"},
                                             {"import", "a.bag", "--topic", "/a"},
                                             {"import", "a.bag", "mongodb://host/roslog"},
                                             {"import", "--as-one", "mongodb://host/roslog"},
                                             {"list", "--colour"},
                                             {"play", "1", "--hz", "50"},
                                             {"play", "1", "--unheard", "wait"},
                                             {"play", "1", "--latency", "ar"},
                                             {"play", "1", "--on-failure", "speech=perhaps"},
                                             {"list", "--since", "some day"}}) {
    EXPECT_EQ(afterglow(arguments).status, 2) << (arguments.empty() ? "" : arguments.back());
  }
}

TEST_F(AfterglowCommand, helps) {
  for (const char* verb : {"import", "list", "show", "said", "export", "play"}) {
    const ProgramResult help = afterglow({verb, "--help"});
    EXPECT_EQ(help.status, 0);
    EXPECT_NE(help.output.find("--store"), std::string::npos) << help.output;
  }
  EXPECT_EQ(afterglow({"--help"}).status, 0);
  EXPECT_EQ(afterglow({"--version"}).output.substr(0, 10), "afterglow ");
}

}  // namespace
}  // namespace afterglow::nodes::afterglow_cli_ros_test
