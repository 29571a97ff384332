// What is on a MongoDB server, as others read it: mongodb_play, mongodb_store, GridFS tools.
#include "replay/store/mongo/mongo_store.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "replay/store/mongo/mongo_query.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/mongo_server.hpp"
#include "tests/support/query_cases.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::mongo_store_test {
namespace {

MongoChannel channelOf(const Channel& channel) {
  return {4,
          {3, "k", "recorder", "fetch7"},
          channel,
          collectionOf(channel.topic),
          std::make_shared<Schema>(Schema::parse(channel.type, channel.definition))};
}

Bytes twist(double x) {
  Bytes bytes(48, 0);
  std::memcpy(bytes.data(), &x, sizeof x);
  return bytes;
}

TEST(MongoLayout, collectionsAreNamedAsMongodbLogNamesThem) {
  EXPECT_EQ(collectionOf("/cmd_vel"), "cmd_vel");
  EXPECT_EQ(collectionOf("/projector/nav/path"), "projector_nav_path");
}

TEST(MongoLayout, messagesAreLaidOutAsMongodbStoreDoes) {
  const Message message{4, Stamp{1'500'000'000'123'456'789}, 7, Stamp{5}, twist(0.5)};
  const MongoDocument made =
      toMongo(message, channelOf(test::twistChannelAt("/cmd_vel")), MongoFields::All, true);
  const auto json = nlohmann::json::parse(made.bson.json());
  EXPECT_EQ(json["linear"]["x"], 0.5);
  EXPECT_EQ(json["angular"]["z"], 0.0);
  const auto& meta = json["_meta"];
  EXPECT_EQ(meta["topic"], "/cmd_vel");
  EXPECT_EQ(meta["latch"], false);
  EXPECT_EQ(meta["stored_type"], "geometry_msgs/Twist");
  EXPECT_EQ(meta["stored_class"], "geometry_msgs.msg._Twist.Twist");
  EXPECT_EQ(meta["inserted_at"]["$date"], "2017-07-14T02:40:00.123Z");
  EXPECT_EQ(meta["received_ns"], 1'500'000'000'123'456'789);
  EXPECT_FALSE(meta.contains("reduced"));
  const nlohmann::json id{{"robot", "fetch7"}, {"recording", "k"}, {"sequence", 7}};
  EXPECT_EQ(json["_id"], id);
  std::string file;
  EXPECT_EQ(fromMongo(made.bson.raw(), file).bytes, message.bytes);
}

TEST(MongoLayout, numbersThatAServerDoesNotTakeBecomeTexts) {
  const MongoChannel channel = channelOf(test::twistChannelAt("/cmd_vel"));
  const Message message{4, Stamp{1}, 7, {}, twist(std::nan(""))};
  const MongoDocument taken = toMongo(message, channel, MongoFields::All, true);
  EXPECT_EQ(nlohmann::json::parse(taken.bson.json())["linear"]["x"]["$numberDouble"], "NaN");
  const MongoDocument refused = toMongo(message, channel, MongoFields::All, false);
  const auto json = nlohmann::json::parse(refused.bson.json());
  EXPECT_EQ(json["linear"]["x"], "nan");
  EXPECT_EQ(json["linear"]["y"], 0.0);
  EXPECT_EQ(json["_meta"]["reduced"], true);
}

TEST(MongoLayout, whatDoesNotFitADocumentIsReducedStepByStep) {
  const Channel blob{"/x", "t/Blob", std::string(32, '0'), "float32[] data\n", false, ""};
  const auto made = [&](std::uint32_t numbers) {
    Bytes bytes(4 + std::size_t{4} * numbers, 0);
    std::memcpy(bytes.data(), &numbers, 4);
    return toMongo({4, Stamp{1}, 7, {}, bytes}, channelOf(blob), MongoFields::All, true);
  };
  EXPECT_TRUE(made(100'000).file.empty());
  const MongoDocument outside = made(800'000);  // the fields fit; the bytes beside them do not
  EXPECT_EQ(outside.file, "k/7");
  EXPECT_GT(outside.bson.size(), 11u << 20);
  const MongoDocument reduced = made(2'000'000);
  EXPECT_TRUE(reduced.file.empty());
  EXPECT_LT(reduced.bson.size(), kLargestMongoDocument);
  EXPECT_EQ(integerAt(reduced.bson.raw(), "data.count"), 2'000'000);
  EXPECT_EQ(made(5'000'000).file, "k/7");
}

TEST(MongoLayout, behaviorsComeBackWhole) {
  Behavior behavior = test::sampleBehavior(3, {"/a"}, 1, 2);
  behavior.id = 5;
  behavior.key = "key";
  behavior.tags = {"a\xFF"};
  const Behavior read = behaviorFromMongo(toMongo(behavior).raw());
  EXPECT_EQ(read.tags, behavior.tags);
  EXPECT_EQ(read.end, behavior.end);
  behavior.end.reset();
  EXPECT_FALSE(behaviorFromMongo(toMongo(behavior).raw()).end);
}

/// The documents that a server would find for what narrowing() asks are a superset of what matches.
TEST(MongoQuery, onlyWhatTheServerComparesAlikeIsAskedOfIt) {
  const Channel things = test::thingsChannel();
  const Schema schema = Schema::parse(things.type, things.definition);
  const auto asked = [&](const char* filter) {
    const Filter parsed = Filter::parse(filter, Filter::Over::Messages);
    const auto narrow = narrowing(parsed.root(), schema);
    return narrow ? narrow->json() : "";
  };
  EXPECT_NE(asked(R"({"things.weight": {"$gt": 1}})").find(R"("things.weight")"),
            std::string::npos);
  EXPECT_NE(asked(R"({"things.name": "tray"})"), "");
  EXPECT_NE(asked(R"({"stamp.secs": {"$lt": 5}})"), "");
  EXPECT_NE(asked(R"({"_meta.stamp_ns": 5})").find("_meta.received_ns"), std::string::npos);
  for (const char* filter :
       {R"({"things.name": {"$gt": "tray"}})", R"({"things.name": {"$regex": "tray"}})",
        R"({"big": {"$gt": 1}})", R"({"done": true})", R"({"counts.count": 65})",
        R"({"things.weight": {"$ne": 1}})", R"({"things.weight": "nan"})",
        R"({"$or": [{"things.weight": 1}, {"done": true}]})", R"({"things.weight": null})"}) {
    EXPECT_EQ(asked(filter), "") << filter;
  }
  EXPECT_NE(asked(R"({"things.weight": 1, "done": true})"), "") << "half of it helps";
}

TEST(MongoErrors, sayOnWhichServerWhatFailed) {
  const std::string uri = "mongodb://user:secret@127.0.0.1:1/d?serverSelectionTimeoutMS=50";
  try {
    MongoStore(uri, OpenMode::ReadWrite);
    FAIL() << "no error";
  } catch (const StoreError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("mongodb://127.0.0.1:1/d: cannot reach the server: "), std::string::npos)
        << text;
    EXPECT_EQ(text.find("secret"), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
  EXPECT_EQ(storeUri(uri), "mongodb://127.0.0.1:1/d");
  EXPECT_EQ(storeUri("mongodb://h,i/d@x"), "mongodb://h,i/d@x");
  EXPECT_THROW(openStore("mongodb://", OpenMode::ReadWrite), StoreError);
  EXPECT_THROW(openStore("mongodb://h/d?nonsense=%", OpenMode::ReadWrite), StoreError);
}

TEST(UndoLog, takesBackTheLastWriteFirstAndFinishesOnlyWhatSucceeded) {
  UndoLog log;
  std::string done;
  const auto write = [&](const std::string& name) {
    done += name;
    log.onFailure([&done, name] { done += " -" + name; });
    log.onSuccess([&done, name] { done += " +" + name; });
  };
  write("a");
  EXPECT_EQ(done, "a +a") << "no transaction: there is nothing to wait for";
  done.clear();
  const auto failing = [&] {
    write("b");
    log.transaction([&] { write("c"); });
    throw StoreError("no");
  };
  EXPECT_THROW(log.transaction(failing), StoreError);
  EXPECT_EQ(done, "bc -c -b");
  done.clear();
  log.transaction([&] { write("d"); });
  EXPECT_EQ(done, "d +d") << "the one that failed is forgotten";
}

class MongoServerTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto why = test::MongoServer::absence()) GTEST_SKIP() << *why;
    static test::MongoServer instance;
    uri = instance.uri();
  }
  std::string uri;
};

TEST_F(MongoServerTest, aDatabaseHoldsMessagesAloneForMongodbPlaysSake) {
  const auto store = openStore(uri, OpenMode::ReadWrite);
  const std::int64_t recording = store->addRecording({0, "", "test", "fetch7"});
  const std::int64_t channel = store->addChannel(recording, test::stringChannel("/a/b"));
  store->append({test::stringMessage(channel, 1, 1, "x")});
  store->addBehavior(test::sampleBehavior(recording, {"/a/b"}, 0, 2));
  store->addFile(std::string(64, 'a'), {1});
  const MongoClient client(uri);
  EXPECT_EQ(client.collections(client.database()), std::vector<std::string>{"a_b"});
  const auto document = client.findOne(client.database(), "a_b", {});
  ASSERT_TRUE(document);
  EXPECT_EQ(textAt(document->raw(), "data"), "x");
}

TEST_F(MongoServerTest, damagedChunksAreNoticed) {
  const auto store = openStore(uri, OpenMode::ReadWrite);
  const std::string sum(64, 'a');
  store->addFile(sum, Bytes(5 << 20, 7));
  EXPECT_EQ(store->file(sum)->size(), std::size_t{5} << 20);
  const MongoClient client(uri);
  client.remove(client.database() + "_afterglow", "fs.chunks", Bson().add("_id", sum + "/1"));
  EXPECT_THROW(store->file(sum), StoreError);
}

TEST_F(MongoServerTest, aNewerStoreIsNotTouched) {
  openStore(uri, OpenMode::ReadWrite);
  const MongoClient client(uri);
  client.upsert(client.database() + "_afterglow", "store",
                Bson().add("_id", "format").add("version", 99));
  EXPECT_THROW(openStore(uri, OpenMode::ReadWrite), StoreError);
}

}  // namespace
}  // namespace afterglow::replay::mongo_store_test
