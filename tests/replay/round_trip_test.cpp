// Whatever a message is, a store gives back its bytes: every type of the installed ROS packages as
// ROS's own Python filled it, and types and messages made at random.
#include <gtest/gtest.h>

#include <set>

#include "replay/messages/definitions.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/message_corpus.hpp"
#include "tests/support/mongo_server.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::round_trip_test {
namespace {

/// Messages of one type.
struct Sample {
  Channel channel;
  std::vector<Bytes> messages;
};

std::vector<Sample> corpusSamples() {
  std::vector<Sample> samples;
  for (const auto& type : test::makeMessageCorpus(AFTERGLOW_TEST_PYTHON).types) {
    // Topics are many to make on a server; a package's types share one.
    const std::string topic = "/" + type.name.substr(0, type.name.find('/'));
    Sample sample{{topic, type.name, type.md5, type.definition, false, "/corpus"}, {}};
    for (const auto& message : type.samples) sample.messages.push_back(message.bytes);
    samples.push_back(std::move(sample));
  }
  return samples;
}

std::vector<Sample> randomSamples() {
  test::RandomMessages random(1);
  std::vector<Sample> samples;
  for (int i = 0; i < 150; ++i) {
    const std::string definition = random.definition();
    const Schema schema = Schema::parse("fuzz/Root", definition);
    const std::string topic = "/random/t" + std::to_string(i % 10);
    Sample sample{
        {topic, "fuzz/Root", definitionMd5("fuzz/Root", definition), definition, i % 2 == 0, ""},
        {}};
    for (int n = 0; n < 5; ++n) sample.messages.push_back(random.message(schema));
    samples.push_back(std::move(sample));
  }
  return samples;
}

/// Appends all and reads all.
void expectToComeBack(Store& store, const std::vector<Sample>& samples) {
  const auto recording = store.addRecording({0, "", "/recorder", "robot"});
  std::vector<Message> messages;
  std::set<std::string> topics;
  for (const Sample& sample : samples) {
    const auto channel = store.addChannel(recording, sample.channel);
    topics.insert(sample.channel.topic);
    for (const Bytes& bytes : sample.messages) {
      const auto sequence = messages.size();
      messages.push_back({channel,
                          Stamp{static_cast<std::int64_t>(1'000'000'000 + sequence / 3)},
                          sequence,
                          {},
                          bytes});
    }
  }
  store.append(messages);
  const auto behavior =
      test::sampleBehavior(recording, {topics.begin(), topics.end()}, 0, 2'000'000'000);
  const auto back = test::readAll(*store.messages(behavior, {}));
  ASSERT_EQ(back.size(), messages.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    const Channel channel = store.channel(back[i].channel);
    ASSERT_EQ(back[i].sequence, i);
    ASSERT_EQ(back[i].received, messages[i].received);
    ASSERT_EQ(back[i].bytes, messages[i].bytes) << i << ", " << channel.topic;
    ASSERT_EQ(channel, store.channel(messages[i].channel));
  }
  for (const Sample& sample : samples) {
    ASSERT_EQ(store.channel(store.addChannel(recording, sample.channel)), sample.channel);
  }
}

/// The kinds of store.
class RoundTripTest : public testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() {
    if (!test::MongoServer::absence()) server_ = std::make_unique<test::MongoServer>();
  }
  static void TearDownTestSuite() { server_.reset(); }

  void SetUp() override {
    if (GetParam() == std::string("SQLite")) {
      store_ = openStore(folder_.path("store.db"), OpenMode::ReadWrite);
    } else if (const auto why = test::MongoServer::absence()) {
      GTEST_SKIP() << *why;
    } else {
      store_ = openStore(server_->uri(), OpenMode::ReadWrite);
    }
  }

  static std::unique_ptr<test::MongoServer> server_;
  test::TempFolder folder_;
  std::unique_ptr<Store> store_;
};

std::unique_ptr<test::MongoServer> RoundTripTest::server_;

TEST_P(RoundTripTest, keepsEveryInstalledTypeByteForByte) {
  const auto samples = corpusSamples();
  if (samples.empty()) GTEST_SKIP() << AFTERGLOW_TEST_PYTHON " has no ROS messages";
  expectToComeBack(*store_, samples);
}

TEST_P(RoundTripTest, keepsRandomTypesByteForByte) { expectToComeBack(*store_, randomSamples()); }

INSTANTIATE_TEST_SUITE_P(Stores, RoundTripTest, testing::Values("SQLite", "MongoDB"),
                         [](const auto& param) { return std::string(param.param); });

}  // namespace
}  // namespace afterglow::replay::round_trip_test
