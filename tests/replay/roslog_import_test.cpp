// Databases as the old writers leave them: documents are written here as their sources do.
#include "replay/store/mongo/roslog_import.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "replay/store/mongo/mongo_client.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/messages.hpp"
#include "tests/support/mongo_server.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::roslog_import_test {
namespace {

using Texts = std::vector<std::string>;
using test::withTypes;

std::optional<Definition> knownDefinition(const std::string& type) {
  const std::map<std::string, std::string> known = {
      {"std_msgs/String", "string data\n"},
      {"tf2_msgs/TFMessage", test::kTfMessage},
      {"sensor_msgs/CompressedImage", withTypes("Header header\nstring format\nuint8[] data\n",
                                                "std_msgs/Header", test::kHeader)}};
  const auto found = known.find(type);
  if (found == known.end()) return std::nullopt;
  return Definition{found->second, definitionMd5(type, found->second)};
}

std::string date(std::int64_t ms) {
  return R"({"$date": {"$numberLong": ")" + std::to_string(ms) + R"("}})";
}

/// The `_id` that ends with these two hex digits.
std::string id(const std::string& end) {
  return R"("_id": {"$oid": "5a000000000000000000)" + std::string(2, '0') + end + R"("})";
}

/// As util.py's store_message does for mongodb_log.py.
std::string loggedString(const std::string& id_end, const std::string& text,
                         const std::string& topic, std::int64_t inserted_ms, bool latch = false) {
  return "{" + id(id_end) + R"(, "data": ")" + text + R"(", "_meta": {"topic": ")" + topic +
         R"(", "latch": )" + (latch ? "true" : "false") + R"(, "inserted_at": )" +
         date(inserted_ms) +
         R"(, "stored_class": "std_msgs.msg._String.String", "stored_type": "std_msgs/String"}})";
}

class RoslogImportTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!test::MongoServer::absence()) server_ = std::make_unique<test::MongoServer>();
  }
  static void TearDownTestSuite() { server_.reset(); }

  void SetUp() override {
    if (const auto why = test::MongoServer::absence()) GTEST_SKIP() << *why;
    uri_ = server_->uri();
    client_ = std::make_unique<MongoClient>(uri_);
    import_.definition = knownDefinition;
  }

  void insert(const std::string& collection, const Texts& documents) const {
    std::vector<Bson> all;
    for (const std::string& json : documents) {
      bson_t bson;
      bson_error_t error;
      ASSERT_TRUE(
          bson_init_from_json(&bson, json.data(), static_cast<ssize_t>(json.size()), &error))
          << error.message << "\n"
          << json;
      all.emplace_back(bson);
      bson_destroy(&bson);
    }
    const MongoWrite write = client_->insert(client_->database(), collection, all);
    ASSERT_TRUE(write.refused.empty() && write.duplicates.empty());
  }

  RoslogImportResult run() { return importRoslog(uri_, *store_, import_); }

  nlohmann::json onlyMessage(const Behavior& behavior, const std::string& topic) const {
    const auto messages = test::readAll(*store_->messages(behavior, {{topic}}));
    if (messages.size() != 1) return std::to_string(messages.size()) + " messages";
    const Channel channel = store_->channel(messages[0].channel);
    return toJson(decode(test::schemaOf(channel), messages[0].bytes));
  }

  std::string error() {
    try {
      run();
    } catch (const StoreError& problem) {
      return problem.what();
    }
    return "";
  }

  static std::unique_ptr<test::MongoServer> server_;
  std::string uri_;
  std::unique_ptr<MongoClient> client_;
  std::unique_ptr<Store> store_ = openMemoryStore();
  RoslogImport import_;
};

std::unique_ptr<test::MongoServer> RoslogImportTest::server_;

TEST_F(RoslogImportTest, readsWhatMongodbLogWroteInTheOrderOfItsTimesThenIds) {
  insert("b", {loggedString("03", "third", "/b", 2000), loggedString("01", "second", "/b", 2000)});
  insert("a",
         {loggedString("02", "between", "/a", 2000), loggedString("09", "first", "/a", 1000, true),
          loggedString("00", "last", "/a", 3000)});
  import_.tags = {"old"};
  const auto result = run();
  EXPECT_EQ(result.messages, 5u);
  EXPECT_EQ(result.remarks, Texts{});
  ASSERT_EQ(result.behaviors.size(), 1u);
  const Behavior behavior = store_->behavior(result.behaviors[0].id).value();
  EXPECT_EQ(behavior.name, client_->database());
  EXPECT_EQ(behavior.outcome, "imported");
  EXPECT_EQ(behavior.begin, Stamp{1'000'000'000});
  EXPECT_EQ(behavior.end, Stamp{3'000'000'001});
  EXPECT_EQ(behavior.topics, (Texts{"/a", "/b"}));
  EXPECT_EQ(behavior.tags, Texts{"old"});
  EXPECT_EQ(test::readTexts(*store_, behavior),
            (Texts{"first", "second", "between", "third", "last"}));
  const auto messages = test::readAll(*store_->messages(behavior, {}));
  EXPECT_EQ(store_->channel(messages[0].channel),
            (Channel{"/a", "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n",
                     true, ""}));
  EXPECT_FALSE(store_->channel(messages[1].channel).latching);
  EXPECT_EQ(store_->recordings()[0].source, client_->name());
}

TEST_F(RoslogImportTest, guessesTheTopicsOfTheCppLoggers) {
  const std::string image = R"("header": {"seq": 1, "stamp": )" + date(1500) +
                            R"(, "frame_id": "eye"}, "format": "jpeg", "data": )"
                            R"({"$binary": {"base64": "/9j/", "subType": "00"}}, "_meta": )"
                            R"({"inserted_at": )" +
                            date(1600) +
                            R"(, "stored_type": "sensor_msgs/CompressedImage", "stored_class": )"
                            R"("sensor_msgs.msg._CompressedImage.CompressedImage"})";
  insert("camera_rgb", {"{" + id("01") + ", " + image + "}"});
  auto result = run();
  EXPECT_EQ(result.behaviors.at(0).topics, Texts{"/camera_rgb"});
  EXPECT_EQ(result.remarks,
            Texts{"/camera_rgb: 1 message of collection camera_rgb, which does not name its "
                  "topic; each '_' may have been a '/' (--topic tells)"});
  EXPECT_EQ(result.behaviors[0].remarks.at(0), result.remarks[0]);
  const auto message = onlyMessage(result.behaviors[0], "/camera_rgb");
  EXPECT_EQ(message["header"]["stamp"], (nlohmann::json{{"secs", 1}, {"nsecs", 500'000'000}}));
  EXPECT_EQ(message["data"], (nlohmann::json{0xFF, 0xD8, 0xFF}));

  import_.topics = {"/camera/rgb"};
  result = run();
  EXPECT_EQ(result.behaviors.at(0).topics, Texts{"/camera/rgb"});
  EXPECT_EQ(result.remarks, Texts{"/camera/rgb: 1 message of collection camera_rgb, which does "
                                  "not name its topic"});
}

TEST_F(RoslogImportTest, readsTheTfLoggersDocuments) {
  insert("tf",
         {"{" + id("01") + R"(, "transforms": [{"header": {"seq": 0, "stamp": )" + date(12345) +
          R"(, "frame_id": "odom"}, "child_frame_id": "base", "transform": {"translation": )"
          R"({"x": 1.5, "y": 0.0, "z": 0.0}, "rotation": )"
          R"({"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}}], "__recorded": )" +
          date(13000) + R"(, "__topic": "/tf"})"});
  const auto result = run();
  EXPECT_EQ(result.behaviors.at(0).begin, Stamp{13'000'000'000});
  const auto message = onlyMessage(result.behaviors[0], "/tf");
  const auto& transform = message["transforms"][0];
  EXPECT_EQ(transform["header"]["stamp"]["nsecs"], 345'000'000);
  EXPECT_EQ(transform["transform"]["translation"]["x"], 1.5);
  const auto channel =
      store_->channel(test::readAll(*store_->messages(result.behaviors[0], {}))[0].channel);
  EXPECT_EQ(channel.md5, "94810edda583a504dfda3829e70d7eec") << "tf/tfMessage has the same";
  EXPECT_EQ(result.remarks, Texts{"/tf: 1 message of tf/tfMessage, now tf2_msgs/TFMessage, which "
                                  "has the same fields and MD5"});
}

TEST_F(RoslogImportTest, readsAMessageStore) {
  insert("message_store", {"{" + id("01") +
                           R"(, "data": "kept", "_meta": {"inserted_by": "/node", "name": "n", )"
                           R"("inserted_at": )" +
                           date(1000) + R"(, "published_at": )" + date(900) +
                           R"(, "stored_class": "std_msgs.msg._String.String"}})"});
  const auto result = run();
  EXPECT_EQ(result.behaviors.at(0).topics, Texts{"/message_store/std_msgs/String"});
  EXPECT_EQ(test::readTexts(*store_, result.behaviors[0]), Texts{"kept"});
}

/// Documents that other programs put in, with what they chose themselves.
TEST_F(RoslogImportTest, takesAnyIdsAndOlderNamesAndNoTimesThatRosLacks) {
  const auto logged = [](const std::string& id, const std::string& text, std::int64_t inserted_ms,
                         const std::string& type) {
    return R"({"_id": )" + id + R"(, "data": ")" + text + R"(", "_meta": {"topic": "a", )" +
           R"("latch": 1, "inserted_at": )" + date(inserted_ms) + ", " + type + "}}";
  };
  const std::string string = R"("stored_class": "std_msgs.msg._String.String")";
  insert("a", {logged("7", "by number", 2000, string), logged(R"("x")", "by text", 1000, string),
               logged("8", "before 1970", -1, string),
               logged("9", "beyond 2106", std::int64_t{1000} << 32, string),
               logged("10", "no package", 1000, R"("stored_class": "String")")});
  insert("tf", {R"({"_id": 1, "transforms": [], "_meta": {"topic": "/tf", "inserted_at": )" +
                date(3000) + R"(, "stored_type": "tf/tfMessage"}})"});
  insert("noise",
         {R"({"_id": 1, "__recorded": )" + date(3000) + "}", R"({"_id": 2, "transforms": []})"});
  const auto result = run();
  const Behavior behavior = result.behaviors.at(0);
  EXPECT_EQ(test::readTexts(*store_, behavior, {{"/a"}}), (Texts{"by text", "by number"}));
  const auto messages = test::readAll(*store_->messages(behavior, {{"/a"}}));
  EXPECT_TRUE(store_->channel(messages[0].channel).latching);
  EXPECT_EQ(result.messages, 3u);
  EXPECT_EQ(result.remarks,
            (Texts{"/tf: 1 message of tf/tfMessage, now tf2_msgs/TFMessage, which has the same "
                   "fields and MD5",
                   "collection a: 3 messages left out: without a type or a time",
                   "collection noise: 2 messages left out: without a type or a time"}));
}

TEST_F(RoslogImportTest, namesWhatItLeavesOutAndFillsIn) {
  insert("a", {loggedString("01", "good", "/a", 1000), "{" + id("02") + R"(, "data": "no meta"})",
               "{" + id("03") + R"(, "data": 5, "_meta": {"topic": "/a", "inserted_at": )" +
                   date(1000) + R"(, "stored_type": "std_msgs/String"}})",
               "{" + id("04") + R"(, "_meta": {"topic": "/a", "inserted_at": )" + date(2000) +
                   R"(, "stored_type": "std_msgs/String"}})",
               "{" + id("05") + R"(, "_meta": {"topic": "/a", "received_ns": 5, "inserted_at": )" +
                   date(2000) + R"(, "stored_type": "std_msgs/String"}})"});
  insert("b", {"{" + id("06") + R"(, "x": 1, "_meta": {"topic": "/b", "inserted_at": )" +
               date(1000) + R"(, "stored_type": "lost_msgs/Type"}})"});
  const auto result = run();
  EXPECT_EQ(result.messages, 2u);
  EXPECT_EQ(
      result.remarks,
      (Texts{"/a: 1 message left out: document of std_msgs/String, field data: is an integer "
             "instead of a string",
             "/a: 1 message without data, which is now zero",
             "/b: 1 message left out: no definition of lost_msgs/Type on this machine or in "
             "the store",
             "collection a: 1 message left out: Afterglow's own; --store reads them, 'afterglow "
             "sync' copies them",
             "collection a: 1 message left out: without a type or a time"}));
  EXPECT_EQ(test::readTexts(*store_, result.behaviors.at(0)), (Texts{"good", ""}));
}

TEST_F(RoslogImportTest, namesTheTopicWhoseDefinitionCannotBeUnderstood) {
  import_.definition = [](const std::string&) {
    return Definition{"this is no definition !\n", std::string(32, '0')};
  };
  insert("a", {loggedString("01", "1", "/a", 1000)});
  EXPECT_EQ(error().rfind(client_->name() + ": /a: ", 0), 0u) << error();
}

TEST_F(RoslogImportTest, takesDefinitionsFromTheStoreToo) {
  Channel channel = test::stringChannel("/elsewhere", "/talker");
  channel.type = "lost_msgs/Type";
  const auto recording = store_->addRecording({0, "", "/recorder", ""});
  const auto known = store_->addChannel(recording, channel);
  store_->append({test::stringMessage(known, 5, 0, "x")});
  store_->addBehavior(test::sampleBehavior(recording, {"/elsewhere"}, 0, 10));
  insert("b", {"{" + id("06") + R"(, "data": "found", "_meta": {"topic": "/b", "inserted_at": )" +
               date(1000) + R"(, "stored_type": "lost_msgs/Type"}})"});
  EXPECT_EQ(test::readTexts(*store_, run().behaviors.at(0)), Texts{"found"});
}

TEST_F(RoslogImportTest, selectsTopicsAndTimesAndSplitsAtGaps) {
  insert("a", {loggedString("01", "1", "/a", 1000), loggedString("02", "2", "/a", 2000),
               loggedString("03", "3", "/a", 9000), loggedString("04", "4", "/a", 9999)});
  insert("b", {loggedString("05", "b", "/b", 2500)});
  import_.split_gap_ns = 2'000'000'000;
  import_.name = "pick";
  auto result = run();
  ASSERT_EQ(result.behaviors.size(), 2u);
  EXPECT_EQ(test::readTexts(*store_, result.behaviors[0]), (Texts{"1", "2", "b"}));
  EXPECT_EQ(test::readTexts(*store_, result.behaviors[1]), (Texts{"3", "4"}));
  EXPECT_EQ(result.behaviors[1].topics, Texts{"/a"});
  EXPECT_EQ(result.behaviors[1].name, "pick");

  import_.topics = {"/a"};
  import_.since = Stamp{2'000'000'000};
  import_.until = Stamp{9'999'000'000};
  import_.split_gap_ns.reset();
  result = run();
  EXPECT_EQ(test::readTexts(*store_, result.behaviors.at(0)), (Texts{"2", "3"}));
}

TEST_F(RoslogImportTest, keepsNothingWhenItFails) {
  EXPECT_EQ(error(), client_->name() + ": there is nothing to import");
  insert("noise", {"{" + id("01") + R"(, "data": "no meta"})"});
  EXPECT_EQ(error(), client_->name() +
                         ": there is nothing to import; collection noise: 1 message "
                         "left out: without a type or a time");
  insert("a", {loggedString("01", "1", "/a", 1000)});
  import_.progress = [](auto, auto) { throw StoreError("as a full disk would"); };
  EXPECT_EQ(error(), "as a full disk would");
  EXPECT_TRUE(store_->recordings().empty());
  EXPECT_TRUE(store_->behaviors({}).empty());
}

TEST(RoslogImport, namesTheServerThatDoesNotAnswer) {
  const auto store = openMemoryStore();
  try {
    importRoslog("mongodb://me:secret@127.0.0.1:1/roslog?serverSelectionTimeoutMS=50", *store);
    FAIL();
  } catch (const StoreError& problem) {
    const std::string text = problem.what();
    EXPECT_EQ(text.find("mongodb://127.0.0.1:1/roslog: cannot "), 0u) << text;
    EXPECT_EQ(text.find("secret"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace afterglow::replay::roslog_import_test
