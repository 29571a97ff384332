// Bags of ROS 2: a folder's files, SQLite files of all releases, and those that lie.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <map>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/mcap_writer.hpp"
#include "replay/messages/definitions.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/message_definitions.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::ros2_bag_test {
namespace {

namespace fs = std::filesystem;
using namespace afterglow::test;
using Texts = std::vector<std::string>;

/// "A" as a my_msgs/msg/Letter.
constexpr const char* kLetter = "X'0001000041'";
constexpr const char* kTables =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
    "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
    "timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
    "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, "
    "encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL);"
    "INSERT INTO topics VALUES(7, '/letter', 'my_msgs/msg/Letter', 'cdr', '- durability: 1');"
    "INSERT INTO message_definitions VALUES(1, 'my_msgs/msg/Letter', 'ros2msg', 'char letter');";

class Ros2BagTest : public testing::Test {
 protected:
  void makeDatabase(const std::string& path, const std::string& sql) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
    char* error = nullptr;
    sqlite3_exec(database, sql.c_str(), nullptr, nullptr, &error);
    ASSERT_EQ(error, nullptr) << error;
    sqlite3_close(database);
  }

  static std::string insert(int id, int stamp_ns, int topic = 7, const char* data = kLetter) {
    return "INSERT INTO messages VALUES(" + std::to_string(id) + ", " + std::to_string(topic) +
           ", " + std::to_string(stamp_ns) + ", " + data + ");";
  }

  static void makeMcap(const std::string& path, const std::string& serialization = "cdr") {
    McapWriter writer(path, path, "ros2", Packing::None);
    const auto schema = writer.addSchema({"my_msgs/msg/Letter", "ros2msg", "char letter"});
    const auto channel = writer.addChannel({schema, "/letter", serialization, {}});
    writer.write(channel, 0, 30, {0, 1, 0, 0, 'C'});
    writer.close();
  }

  /// What an import says, without the names of the folder; "" if it succeeds.
  std::string errorOf(const std::string& path) {
    const auto store = openMemoryStore();
    try {
      importBag(path, *store);
      return "";
    } catch (const BagError& error) {
      EXPECT_TRUE(store->recordings().empty()) << "half an import was kept";
      std::string said = error.what();
      EXPECT_EQ(said.find('\n'), std::string::npos) << said;
      const std::string root = folder_.path("");
      for (std::size_t at = 0; (at = said.find(root)) != std::string::npos;) {
        said.erase(at, root.size());
      }
      return said;
    }
  }

  TempFolder folder_;
  std::string path_ = folder_.path("a.db3");
};

TEST_F(Ros2BagTest, isReadByTheDefinitionsInIt) {
  makeDatabase(path_, std::string(kTables) + insert(1, 20) + insert(2, 10) +
                          insert(3, 15, 7, "X'00010000'"));
  const auto store = openMemoryStore();
  const auto result = importBag(path_, *store);
  EXPECT_EQ(result.messages, 2u);
  EXPECT_EQ(result.remarks,
            (Texts{path_ + ": left out 1 messages of /letter (my_msgs/Letter) as my_msgs/Letter, "
                           "field letter, at byte 4: counts 1 elements of 1 bytes; 0 are left",
                   path_ + ": /letter (my_msgs/Letter) keeps the fields of ROS 2 and is not sent "
                           "to a robot of ROS 1: no ROS 1 type my_msgs/Letter is known here"}));
  EXPECT_EQ(result.behavior.begin, Stamp{10});
  EXPECT_EQ(result.behavior.end, Stamp{21});
  const auto messages = readAll(*store->messages(result.behavior, {}));
  EXPECT_EQ(messages.at(0).received, Stamp{10});
  EXPECT_EQ(messages.at(0).bytes, (Bytes{'A'}));
  EXPECT_TRUE(store->channel(messages.at(0).channel).latching);
}

TEST_F(Ros2BagTest, isNotSentToARobotOfRos1WhereTheFieldsDoNotAgree) {
  makeMcap(path_);
  const auto store = openMemoryStore();
  const Behavior behavior = importBag(path_, *store).behavior;
  PlanOptions options;
  const std::string why =
      "its type and fields do not agree with ROS 1's, as it comes from ROS 2: no ROS 1 type "
      "my_msgs/Letter is known here";
  EXPECT_EQ(makePlan(*store, behavior, options).topics.at(0).why_not, why);
  EXPECT_EQ(makePlan(*store, behavior, options).refusal(), "") << "nobody asked for it";
  options.topics = {"/letter"};
  EXPECT_EQ(makePlan(*store, behavior, options).refusal(),
            "/letter (my_msgs/Letter) is not played: " + why + "; --exclude it to play the rest");
  options.topics.clear();
  options.place = ReplayPlace::Elsewhere;
  EXPECT_FALSE(makePlan(*store, behavior, options).topics.at(0).isPlayed());
}

/// The header's seq aside, which ROS 2 has not.
TEST_F(Ros2BagTest, asAnMcapFileIsExportedAndGivesTheMessagesBack) {
  const auto store = openMemoryStore();
  const auto recording = store->addRecording({0, "", "/recorder", ""});
  std::uint64_t sequence = 0;
  const auto keep = [&](const Channel& channel, const Bytes& bytes) {
    Message message = stringMessage(store->addChannel(recording, channel), 10, ++sequence, "");
    message.bytes = bytes;
    store->append({message});
  };
  const Schema tf = Schema::parse("tf2_msgs/TFMessage", kTfMessage);
  Bytes transform(4 + tf.minimumSize(1));
  transform[0] = 1;
  const std::string md5 = definitionMd5("tf2_msgs/TFMessage", kTfMessage);
  keep({"/tf_static", "tf2_msgs/TFMessage", md5, kTfMessage, true, "/tf"}, transform);
  keep(stringChannel("/said"), stringBytes("here"));
  BagExport as_ros2;
  as_ros2.format = RecordingFormat::Mcap;
  as_ros2.is_ros2 = true;
  const std::string path = folder_.path("out.mcap");
  exportBags(*store, {sampleBehavior(recording, {"/tf_static", "/said"}, 0, 20)}, {}, path,
             as_ros2);
  const auto again = openMemoryStore();
  const auto result = importBag(path, *again);
  std::map<std::string, Bytes> given;
  for (const Message& message : readAll(*again->messages(result.behavior, {}))) {
    const Channel channel = again->channel(message.channel);
    EXPECT_EQ(channel.latching, channel.topic == "/tf_static");
    given[channel.topic] = message.bytes;
  }
  EXPECT_EQ(given, (std::map<std::string, Bytes>{{"/tf_static", transform},
                                                 {"/said", stringBytes("here")}}));
}

TEST_F(Ros2BagTest, isNotExportedWhereAMessageIsNoneOfRos2) {
  const auto store = openMemoryStore();
  const auto recording = store->addRecording({0, "", "/recorder", ""});
  const Channel channel{"/t",          "std_msgs/Time", "cd7166c74c552c311fbcc2fe5a7bc289",
                        "time data\n", false,           ""};
  Message late = stringMessage(store->addChannel(recording, channel), 10, 1, "");
  late.bytes = {0, 0, 0, 0x80, 0, 0, 0, 0};
  store->append({late});
  BagExport as_ros2;
  as_ros2.format = RecordingFormat::Mcap;
  as_ros2.is_ros2 = true;
  const std::string path = folder_.path("out.mcap");
  try {
    exportBags(*store, {sampleBehavior(recording, {"/t"}, 0, 20)}, {}, path, as_ros2);
    ADD_FAILURE() << "it was exported";
  } catch (const BagError& error) {
    EXPECT_EQ(error.what(),
              path +
                  ": a message of /t is none of ROS 2's: std_msgs/Time, field data, at byte 4: "
                  "is a time after 2038, which ROS 2 has not");
  }
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(Ros2BagTest, isAFolderOfTheFilesThatItNames) {
  makeDatabase(path_, kTables + insert(1, 20));
  makeMcap(folder_.path("b.mcap"));
  const auto read = [&](const std::string& path) {
    const auto store = openMemoryStore();
    const auto result = importBag(path, *store);
    return result.behavior.name + " " + std::to_string(result.messages);
  };
  const std::string name = fs::path(folder_.path("x")).parent_path().filename().string();
  EXPECT_EQ(read(folder_.path("")), name + " 2") << "all, where it names none";
  writeFile(folder_.path("metadata.yaml"),
            "rosbag2_bagfile_information:\n  relative_file_paths:\n    - \"bag/b.mcap\"\n"
            "  files:\n    - path: b.mcap\n");
  EXPECT_EQ(read(folder_.path("")), name + " 1");
  writeFile(folder_.path("metadata.yaml"), "relative_file_paths:\n- b.mcap\n- gone.db3\n");
  EXPECT_EQ(errorOf(folder_.path("")), "gone.db3: cannot open: No such file or directory");
  writeFile(folder_.path("metadata.yaml"), "relative_file_paths:\n- b.mcap.zstd\n");
  EXPECT_EQ(errorOf(folder_.path("")),
            "metadata.yaml: the bag is compressed as files; 'zstd -d --rm' unpacks b.mcap.zstd");
}

TEST_F(Ros2BagTest, saysWhatIsNoBag) {
  makeDatabase(path_, "CREATE TABLE topics(id INTEGER PRIMARY KEY)");
  EXPECT_EQ(errorOf(path_), "a.db3: is no bag of ROS 2: it has no table \"messages\"");
  fs::create_directory(folder_.path("empty"));
  EXPECT_EQ(errorOf(folder_.path("empty")),
            "empty: is a folder without a bag of ROS 2: no .db3 or .mcap is in it");
  makeMcap(path_, "json");
  EXPECT_EQ(errorOf(path_),
            "a.db3: the bag holds no messages that can be read; a.db3: left out 1 messages of "
            "/letter (my_msgs/msg/Letter) as it is in \"json\"; messages in ros1 and cdr are "
            "read, with definitions");
}

TEST_F(Ros2BagTest, runsNothingThatTheFileSays) {
  makeDatabase(path_,
               "CREATE TABLE topics(id INTEGER PRIMARY KEY);"
               "CREATE VIEW messages AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 "
               "FROM n) SELECT x AS topic_id, x AS timestamp, x AS data FROM n;");
  EXPECT_EQ(errorOf(path_), "a.db3: is no bag of ROS 2: it has no table \"messages\"");
}

TEST_F(Ros2BagTest, saysWhichMessageIsFalse) {
  makeDatabase(path_, kTables + insert(4, 10) + insert(5, 11, 8));
  EXPECT_EQ(errorOf(path_), "a.db3: message 5 is of a topic that is not there");
  fs::remove(path_);
  makeDatabase(path_, kTables + insert(4, -1));
  EXPECT_EQ(errorOf(path_), "a.db3: message 4 has a stamp before 1970");
}

TEST_F(Ros2BagTest, survivesDamageAnywhereWithoutACrash) {
  makeDatabase(path_, "PRAGMA page_size = 512;" + (kTables + insert(1, 20)) + insert(2, 10));
  const std::string whole = fileBytes(path_);
  for (std::size_t at = 16; at < whole.size(); at += 3) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ (at % 2 == 0 ? 0xff : 0x01));
    writeFile(path_, damaged);
    errorOf(path_);
  }
  for (std::size_t size = 0; size < whole.size(); size += 31) {
    writeFile(path_, whole.substr(0, size));
    EXPECT_NE(errorOf(path_), "") << "cut to " << size << " bytes";
  }
}

}  // namespace
}  // namespace afterglow::replay::ros2_bag_test
