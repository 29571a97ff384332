// Importing a database of mongodb_log while a write or a sync of the store fails. Not while memory
// ends: libbson ends a program that has none for it.
#include <gtest/gtest.h>

#include "replay/store/mongo/mongo_client.hpp"
#include "replay/store/mongo/roslog_import.hpp"
#include "tests/support/call_faults.hpp"
#include "tests/support/mongo_server.hpp"

namespace afterglow::replay::roslog_faults_test {
namespace {

using namespace afterglow::test;

/// 200 documents as mongodb_log leaves them.
void insertLog(const std::string& uri) {
  const MongoClient client(uri);
  std::vector<Bson> documents;
  for (int i = 0; i < 200; ++i) {
    const std::string json =
        R"({"data": ")" + scenes::textOf(i) + R"(", "_meta": {"topic": "/a", "latch": false, )" +
        R"("inserted_at": {"$date": {"$numberLong": ")" + std::to_string(1000 + i) +
        R"("}}, "stored_class": "std_msgs.msg._String.String", "stored_type": "std_msgs/String"}})";
    bson_t bson;
    bson_error_t error;
    ASSERT_TRUE(bson_init_from_json(&bson, json.data(), static_cast<ssize_t>(json.size()), &error))
        << error.message;
    documents.emplace_back(bson);
    bson_destroy(&bson);
  }
  client.insert(client.database(), "a", documents);
}

TEST(RoslogFaults, ofTheDiskLeaveAnImportWholeOrNotThere) {
  if (const auto why = MongoServer::absence()) GTEST_SKIP() << *why;
  const MongoServer server;
  const std::string uri = server.uri();
  insertLog(uri);
  RoslogImport import;
  import.definition = [](const std::string& type) {
    return Definition{"string data\n", definitionMd5(type, "string data\n")};
};
expectNothingLost(
    [&](const std::string& folder, Witness& witness) {
      witness.attempt([&] {
        SqliteStore store(scenes::storeIn(folder), OpenMode::ReadWrite, scenes::shortLog());
        const auto result = importRoslog(uri, store, import);
        ASSERT_EQ(result.messages, 200u);
        for (const Behavior& behavior : result.behaviors) {
          witness.keep(store.behavior(behavior.id).value().key, false, result.messages);
        }
      });
    },
    kOfTheDisk);
}  // namespace

}  // namespace afterglow::replay::roslog_faults_test
}  // namespace afterglow::replay::roslog_faults_test
