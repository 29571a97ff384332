// Every type of the ROS message packages, against ROS's own Python. What is true of all messages is
// tested here as well, for want of better examples.
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "replay/messages/document.hpp"
#include "replay/messages/field_edit.hpp"
#include "tests/support/document_fields.hpp"
#include "tests/support/message_corpus.hpp"

namespace afterglow::replay::message_corpus_test {
namespace {

// Cutting longer messages at every byte takes too long.
constexpr std::size_t kLongest = 1000;

class MessageCorpusTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { corpus_ = test::makeMessageCorpus(AFTERGLOW_TEST_PYTHON); }

  void SetUp() override {
    if (corpus_.types.empty()) GTEST_SKIP() << AFTERGLOW_TEST_PYTHON " has no ROS messages";
  }

  /// Calls f(schema, type, sample) for every sample.
  template <typename F>
  void forEach(F&& f) {
    for (const auto& type : corpus_.types) {
      SCOPED_TRACE(type.name);
      const Schema schema = Schema::parse(type.name, type.definition);
      for (const auto& sample : type.samples) f(schema, sample);
    }
  }

  static test::MessageCorpus corpus_;
};

test::MessageCorpus MessageCorpusTest::corpus_;

TEST_F(MessageCorpusTest, coversThePackages) {
  for (const std::string& package : corpus_.missing_packages) {
    std::printf("not installed here: %s\n", package.c_str());
  }
  if (corpus_.missing_packages.empty()) {
    EXPECT_GE(corpus_.types.size(), 158u);
  }
}

TEST_F(MessageCorpusTest, readsTheValuesThatRosWrote) {
  const JsonOptions all{std::numeric_limits<std::size_t>::max()};
  forEach([&](const Schema& schema, const auto& sample) {
    ASSERT_EQ(toJson(decode(schema, sample.bytes), all), sample.values);
  });
}

TEST_F(MessageCorpusTest, writesTheSameBytesAgain) {
  forEach([](const Schema& schema, const auto& sample) {
    ASSERT_EQ(encode(schema, decode(schema, sample.bytes)), sample.bytes);
  });
}

TEST_F(MessageCorpusTest, findsTheStampsThatRosWrote) {
  std::size_t found = 0;
  forEach([&](const Schema& schema, const auto& sample) {
    if (!sample.values.contains("header")) return;
    const auto& stamp = sample.values["header"]["stamp"];
    const Stamp expected = Stamp::fromParts(stamp["secs"], stamp["nsecs"]);
    const auto spans = findField(schema, sample.bytes, FieldPath::parse("header.stamp"));
    ASSERT_EQ(spans.size(), 1u);
    ASSERT_EQ(readTime(sample.bytes, spans[0]), expected);
    const bool first = schema.root().fields.front().name == "header";
    ASSERT_EQ(headerStamp(schema, sample.bytes), first ? std::optional(expected) : std::nullopt);
    ++found;
  });
  EXPECT_GT(found, 100u);
}

TEST_F(MessageCorpusTest, walksWholeMessagesToTheLastByte) {
  forEach([](const Schema& schema, const auto& sample) {
    const FieldFinder finder(schema, test::timeFields(schema));
    ASSERT_NO_THROW(finder.find(sample.bytes));
    Bytes longer = sample.bytes;
    longer.push_back(0);
    ASSERT_THROW(finder.find(longer), MessageError);
    ASSERT_THROW(decode(schema, longer), MessageError);
  });
}

TEST_F(MessageCorpusTest, refusesEveryTruncation) {
  forEach([](const Schema& schema, const auto& sample) {
    if (sample.bytes.size() > kLongest) return;
    const FieldFinder finder(schema, test::timeFields(schema));
    for (std::size_t size = 0; size < sample.bytes.size(); ++size) {
      const Bytes cut(sample.bytes.begin(), sample.bytes.begin() + static_cast<int>(size));
      ASSERT_THROW(decode(schema, cut), MessageError) << "at " << size;
      ASSERT_THROW(finder.find(cut), MessageError) << "at " << size;
    }
  });
}

TEST_F(MessageCorpusTest, readsOrRefusesFlippedBitsButNeverChangesThem) {
  std::mt19937 random(1);
  forEach([&](const Schema& schema, const auto& sample) {
    for (int i = 0; i < 20 && !sample.bytes.empty(); ++i) {
      Bytes flipped = sample.bytes;
      flipped[random() % flipped.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
      try {
        ASSERT_EQ(encode(schema, decode(schema, flipped)), flipped);
      } catch (const MessageError&) {
        // Most often a length that no longer fits.
      }
    }
  });
}

}  // namespace
}  // namespace afterglow::replay::message_corpus_test
