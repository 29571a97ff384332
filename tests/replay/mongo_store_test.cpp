// What is on a MongoDB server, as others read it: mongodb_play, mongodb_store, GridFS tools.
#include "replay/store/mongo/mongo_store.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>

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

TEST(MongoLayout, messagesOfAnotherProgramThatLackWhatAfterglowWritesAreNamed) {
  const Message message{4, Stamp{1}, 7, {}, twist(0.5)};
  const MongoDocument made =
      toMongo(message, channelOf(test::twistChannelAt("/cmd_vel")), MongoFields::None, true);
  const auto without = [&](const std::string& field, const std::string& given = "") {
    auto json = nlohmann::json::parse(made.bson.json());
    json["_meta"].erase(field);
    if (!given.empty()) json["_meta"][field] = given;
    const std::string text = json.dump();
    bson_error_t error;
    bson_t document;
    EXPECT_TRUE(bson_init_from_json(&document, text.c_str(), -1, &error)) << error.message;
    const Bson read(document);
    bson_destroy(&document);
    std::string file;
    try {
      const Message found = fromMongo(read.raw(), file);
      return "file " + file + ", " + std::to_string(found.bytes.size()) + " bytes";
    } catch (const StoreError& missing) {
      return std::string(missing.what());
    }
  };
  EXPECT_EQ(without("reduced"), "file , 48 bytes");
  EXPECT_EQ(without("channel"), "a message lacks _meta.channel");
  EXPECT_EQ(without("received_ns"), "a message lacks _meta.received_ns");
  EXPECT_EQ(without("received_ns", "soon"), "a message lacks _meta.received_ns");
  EXPECT_EQ(without("sequence"), "a message lacks _meta.sequence");
  EXPECT_EQ(without("bytes"), "a message lacks _meta.bytes");
  EXPECT_EQ(without("bytes", "a text"), "a message lacks _meta.bytes");
}

TEST(MongoLayout, rootTopicsAndTypesThatAreNoneHaveNames) {
  EXPECT_EQ(collectionOf("/"), "_");
  MongoChannel odd = channelOf(test::stringChannel("/x"));
  odd.channel.type = "Odd";
  odd.schema = nullptr;
  const MongoDocument made = toMongo({4, Stamp{1}, 7, {}, {1}}, odd, MongoFields::All, true);
  EXPECT_EQ(textAt(made.bson.raw(), "_meta.stored_class"), "Odd");
}

TEST(MongoBson, isReadAsWhatItIsAlone) {
  const Bson document = Bson()
                            .add("text", "a")
                            .add("number", 7)
                            .add("texts", std::vector<std::string>{"a", "b\xFF"})
                            .add("numbers", std::vector<std::int64_t>{1, 2})
                            .addNull("nothing")
                            .addDate("date", 5);
  const bson_t& raw = document.raw();
  EXPECT_EQ(integerAt(raw, "number"), 7);
  EXPECT_FALSE(integerAt(raw, "text"));
  EXPECT_FALSE(integerAt(raw, "missing"));
  EXPECT_FALSE(textAt(raw, "number"));
  EXPECT_FALSE(bytesAt(raw, "text"));
  EXPECT_FALSE(bytesAt(raw, "missing"));
  EXPECT_EQ(dateAt(raw, "date"), 5);
  EXPECT_FALSE(dateAt(raw, "number"));
  EXPECT_FALSE(dateAt(raw, "missing"));
  EXPECT_EQ(textsAt(raw, "texts"), (std::vector<std::string>{"a", "b\xFF"}));
  EXPECT_TRUE(textsAt(raw, "numbers").empty());
  EXPECT_TRUE(textsAt(raw, "text").empty());
  EXPECT_TRUE(textsAt(raw, "missing").empty());
  EXPECT_TRUE(isTrueAt(raw, "number"));
  EXPECT_FALSE(isTrueAt(raw, "nothing"));
  EXPECT_FALSE(isTrueAt(raw, "missing"));
}

TEST(MongoBson, numbersThatAreNotFiniteAreFoundInDocumentsAndArrays) {
  Bson inner;
  inner.add("x", HUGE_VAL).add("y", 1.0);
  Bson array;
  array.add("0", -HUGE_VAL).add("1", "text");
  Bson document;
  document.add("inner", inner).add("n", 5);
  bson_append_array(&document.raw(), "list", -1, &array.raw());
  const auto finite = withoutNonFinite(document.raw());
  ASSERT_TRUE(finite);
  EXPECT_EQ(nlohmann::json::parse(finite->json()),
            nlohmann::json::parse(
                R"({"inner": {"x": "inf", "y": 1.0}, "n": 5, "list": ["-inf", "text"]})"));
  EXPECT_FALSE(withoutNonFinite(finite->raw())) << "nothing is left to replace";
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
  EXPECT_NE(asked(R"({"_meta.sequence": {"$lte": 5}})").find(R"("_meta.sequence" : { "$lte" : )"),
            std::string::npos);
  EXPECT_NE(asked(R"({"$or": [{"things.weight": {"$gte": 1}}, {"stamp.nsecs": 5}]})"), "");
  for (const char* filter :
       {R"({"things.name": {"$gt": "tray"}})", R"({"things.name": {"$regex": "tray"}})",
        R"({"big": {"$gt": 1}})", R"({"done": true})", R"({"counts.count": 65})",
        R"({"things.weight": {"$ne": 1}})", R"({"things.weight": "nan"})",
        R"({"$or": [{"things.weight": 1}, {"done": true}]})", R"({"things.weight": null})",
        R"({"things.weight": 18446744073709551615})", R"({"things.0.weight": 1})",
        R"({"things.weight.x": 1})", R"({"nothing": 1})", R"({"stamp": 5})", R"({"things": 5})",
        R"({"things.name": 5})", R"({"things.name": "\uFFFD"})", R"({"stamp.days": 5})"}) {
    EXPECT_EQ(asked(filter), "") << filter;
  }
  EXPECT_NE(asked(R"({"things.weight": 1, "done": true})"), "") << "half of it helps";
}

TEST(MongoQuery, asksTheServerForBytesButNotForTheirArrays) {
  const Schema schema = Schema::parse("t/T", "uint8 level\nuint8[] data\n");
  const auto isAsked = [&](const char* filter) {
    return narrowing(Filter::parse(filter, Filter::Over::Messages).root(), schema).has_value();
  };
  EXPECT_TRUE(isAsked(R"({"level": 5})"));
  EXPECT_FALSE(isAsked(R"({"data": 5})"));
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
  const test::TempFolder folder;
  test::writeFile(folder.path("uri"), uri);
  try {
    openStore("@" + folder.path("uri"), OpenMode::ReadWrite);
    FAIL() << "no error";
  } catch (const StoreAway& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.rfind("@" + folder.path("uri") + ": cannot reach the server: ", 0), 0u) << text;
  }
  EXPECT_THROW(openStore("mongodb://", OpenMode::ReadWrite), StoreError);
  EXPECT_THROW(openStore("mongodb://h/d?nonsense=%", OpenMode::ReadWrite), StoreError);
}

TEST(MongoErrors, nameAllHostsOfAReplicaSetAndTheDefaultDatabase) {
  EXPECT_EQ(MongoClient("mongodb://h:1,i:2").name(), "mongodb://h:1,i:2/roslog");
  EXPECT_EQ(MongoClient("mongodb://h:1/?w=1").database(), "roslog");
  EXPECT_EQ(MongoClient("mongodb://h:1/fleet?journal=false").database(), "fleet");
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

TEST_F(MongoServerTest, anImportWhoseLeaseHasEndedIsDroppedByWhoeverLooks) {
  const auto dying = openStore(uri, OpenMode::ReadWrite);
  const std::int64_t import = dying->beginImport({0, "", "a.bag", ""});
  const std::int64_t channel = dying->addChannel(import, test::stringChannel("/imported"));
  dying->append({test::stringMessage(channel, 1, 0, "x")});
  const auto next = openStore(uri, OpenMode::ReadWrite);
  EXPECT_EQ(next->dropUnfinished(), 0u);
  const MongoClient client(uri);
  client.update(client.database() + "_afterglow", "recordings", withId(import),
                Bson().add("$set", Bson().addDate("import_until", 1)));
  EXPECT_EQ(next->dropUnfinished(), 1u);
  EXPECT_TRUE(next->recordings().empty());
  EXPECT_EQ(client.count(client.database(), "imported", {}), 0);
  EXPECT_THROW(dying->finishImport(import), StoreError) << "it was too late";
}

TEST_F(MongoServerTest, aChannelWithoutItsDefinitionIsNamed) {
  const auto store = openStore(uri, OpenMode::ReadWrite);
  const std::int64_t recording = store->addRecording({0, "", "test", "fetch7"});
  const std::int64_t channel = store->addChannel(recording, test::stringChannel("/a"));
  const MongoClient client(uri);
  client.remove(client.database() + "_afterglow", "definitions", {});
  try {
    openStore(uri, OpenMode::ReadOnly)->channel(channel);
    FAIL() << "read";
  } catch (const StoreError& error) {
    const std::string why =
        "cannot read channel " + std::to_string(channel) + ": its definition is missing";
    EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
  }
}

TEST_F(MongoServerTest, aMessageWhoseFileIsGoneIsNamed) {
  const auto store = openStore(uri, OpenMode::ReadWrite);
  const std::int64_t recording = store->addRecording({0, "", "test", "fetch7"});
  const std::int64_t channel = store->addChannel(
      recording, {"/x", "t/Odd", std::string(32, '0'), "this is no definition !\n", false, ""});
  store->append({{channel, Stamp{1}, 7, {}, Bytes(17 << 20, 1)}});
  const Behavior all = test::sampleBehavior(recording, {"/x"}, 0, 9);
  EXPECT_EQ(store->messages(all, {})->next()->bytes.size(), std::size_t{17} << 20);
  const MongoClient client(uri);
  client.remove(client.database() + "_afterglow", "fs.files", {});
  try {
    store->messages(all, {})->next();
    FAIL() << "read";
  } catch (const StoreError& error) {
    EXPECT_NE(std::string(error.what()).find("cannot read message 7: its file is gone"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(MongoServerTest, aRequestThatTheServerRefusesIsNoReasonToTryItAgain) {
  const MongoClient client(uri);
  try {
    client.command("admin", Bson().add("noSuchCommand", 1), "ask the server");
    FAIL() << "answered";
  } catch (const StoreAway& error) {
    FAIL() << error.what();
  } catch (const StoreError& error) {
    EXPECT_EQ(std::string(error.what()).rfind(client.name() + ": cannot ask the server: ", 0), 0u)
        << error.what();
  }
  EXPECT_THROW(client.upsert(client.database(), "a", Bson().add("x", 1)), StoreError);
}

TEST_F(MongoServerTest, everyCallSaysWhatItTriedOnAServerThatIsGone) {
  test::MongoServer gone;
  if (!gone.isOwn()) GTEST_SKIP() << "the server is not this test's to stop";
  const MongoClient client(gone.uri("serverSelectionTimeoutMS=50&connectTimeoutMS=50"));
  gone.kill();
  const Bson document = withId(1);
  const std::pair<const char*, std::function<void()>> calls[] = {
      {"read a", [&] { client.findOne("d", "a", {}); }},
      {"count a", [&] { client.count("d", "a", {}); }},
      {"write to a", [&] { client.insert("d", "a", {document}); }},
      {"write to a", [&] { client.upsert("d", "a", document); }},
      {"change a", [&] { client.update("d", "a", {}, Bson().add("$set", document)); }},
      {"remove from a", [&] { client.remove("d", "a", {}); }},
      {"make an index of a", [&] { client.makeIndex("d", "a", {"x"}); }},
      {"take a number of a", [&] { client.takeNumber("d", "a"); }},
      {"list the collections of d", [&] { client.collections("d"); }}};
  for (const auto& [doing, call] : calls) {
    try {
      call();
      ADD_FAILURE() << doing << ": no error";
    } catch (const StoreAway& error) {
      EXPECT_EQ(std::string(error.what()).rfind(client.name() + ": cannot " + doing + ": ", 0), 0u)
          << error.what();
    }
  }
  EXPECT_TRUE(client.insert("d", "a", {}).refused.empty()) << "nothing to ask the server for";
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
