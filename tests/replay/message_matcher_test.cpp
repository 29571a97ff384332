#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "replay/query/filter.hpp"

namespace afterglow::replay::message_matcher_test {
namespace {

using nlohmann::json;

const char* const kDefinition =
    "Header header\nfloat64 x\nint64 big\nbool flag\nstring text\nint32[] list\nPart[] parts\n"
    "duration wait\n"
    "================================================================================\n"
    "MSG: test/Part\nstring name\nfloat32 v\nuint8 type\n";

Schema schema() { return Schema::parse("test/All", kDefinition); }

/// Random messages of few different values, so that filters hit and miss.
class Messages {
 public:
  explicit Messages(unsigned seed) : random_(seed) {}

  Bytes next(const Schema& type) {
    const Object message = {{"header", header()},
                            {"x", real()},
                            {"big", (std::int64_t{1} << 53) + pick(4)},
                            {"flag", BoolByte{static_cast<std::uint8_t>(pick(10) == 0)}},
                            {"text", text()},
                            {"list", list()},
                            {"parts", parts()},
                            {"wait", RosDuration{static_cast<std::int32_t>(pick(3)) - 1, 5}}};
    return encode(type, message);
  }
  std::int64_t pick(std::int64_t count) {
    return std::uniform_int_distribution<std::int64_t>(0, count - 1)(random_);
  }
  double real() {
    if (pick(40) == 0) {
      return std::vector<double>{HUGE_VAL, -HUGE_VAL,
                                 std::nan("")}[static_cast<std::size_t>(pick(3))];
    }
    return static_cast<double>(level_ + pick(5)) * 0.5;
  }
  std::string text() {
    static const std::vector<std::string> texts = {
        "",    "a",    "pick the red cube", "pick the red cone",        "inf",
        "nan", "grün", "\xff\xfe",          std::string(70, 'x') + "1", std::string(70, 'x') + "2"};
    return texts[static_cast<std::size_t>((level_ + pick(3)) % 10)];
  }
  /// Values wander from block to block.
  void wander() { level_ = pick(10); }

 private:
  Object header() {
    return {{"seq", static_cast<std::uint32_t>(++seq_)},
            {"stamp", RosTime{100 + seq_ / 10, 0}},
            {"frame_id", std::string("map")}};
  }
  NumberArray list() {
    NumberArray array{FieldType::Int32, {}};
    const auto count = pick(20) == 0 ? 70 : pick(3);
    for (std::int64_t i = 0; i < count; ++i) {
      for (const std::uint8_t byte : {static_cast<std::uint8_t>(level_ + i), std::uint8_t{0},
                                      std::uint8_t{0}, std::uint8_t{0}}) {
        array.bytes.push_back(byte);
      }
    }
    return array;
  }
  Array parts() {
    Array array;
    const auto count = pick(20) == 0 ? 65 : pick(3);
    for (std::int64_t i = 0; i < count; ++i) {
      array.push_back(Object{{"name", text()},
                             {"v", static_cast<float>(pick(4))},
                             {"type", static_cast<std::uint8_t>(pick(3))}});
    }
    return array;
  }

  std::mt19937 random_;
  std::int64_t level_ = 0;
  std::uint32_t seq_ = 0;
};

json valueFor(const std::string& path, Messages& random) {
  if (path == "text" || path == "parts.name") {
    const std::string text = random.text();
    return text == "\xff\xfe" ? "a" : text;
  }
  if (path == "flag") return random.pick(2) == 0;
  if (path == "big") return (std::int64_t{1} << 53) + random.pick(5);
  if (random.pick(12) == 0) return nullptr;
  if (random.pick(15) == 0)
    return std::vector<std::string>{"inf", "-inf", "nan"}[static_cast<std::size_t>(random.pick(3))];
  return 0.5 * static_cast<double>(random.pick(20));
}

json randomTest(const std::string& path, Messages& random) {
  static const std::vector<std::string> operators = {"$eq",  "$ne", "$gt",     "$gte", "$lt",
                                                     "$lte", "$in", "$exists", "$nin"};
  const std::string op = operators[static_cast<std::size_t>(random.pick(9))];
  json value = valueFor(path, random);
  if (op == "$exists") return {{op, random.pick(2) == 0}};
  if (op == "$in" || op == "$nin") return {{op, {value, valueFor(path, random)}}};
  if (random.pick(6) == 0 && value.is_string()) return {{"$regex", "re"}};
  return {{op, value}};
}

json randomFilter(Messages& random, int depth = 0) {
  static const std::vector<std::string> paths = {"x",
                                                 "big",
                                                 "flag",
                                                 "text",
                                                 "list",
                                                 "list.1",
                                                 "parts.name",
                                                 "parts",
                                                 "parts.v",
                                                 "parts.type",
                                                 "parts.count",
                                                 "list.count",
                                                 "nothing",
                                                 "parts.0.v",
                                                 "wait.secs",
                                                 "header.stamp.secs",
                                                 "header.frame_id",
                                                 "header",
                                                 "x.y",
                                                 "header.seq"};
  const auto kind = depth > 2 ? 0 : random.pick(8);
  if (kind == 1)
    return {{"$or", {randomFilter(random, depth + 1), randomFilter(random, depth + 1)}}};
  if (kind == 2)
    return {{"$and", {randomFilter(random, depth + 1), randomFilter(random, depth + 1)}}};
  if (kind == 3) return {{"$nor", {randomFilter(random, depth + 1)}}};
  if (kind == 4) {
    return {
        {"parts",
         {{"$elemMatch",
           {{"name", randomTest("parts.name", random)}, {"v", randomTest("parts.v", random)}}}}}};
  }
  if (kind == 5) return {{"list", {{"$elemMatch", randomTest("list", random)}}}};
  const std::string path =
      paths[static_cast<std::size_t>(random.pick(static_cast<std::int64_t>(paths.size())))];
  return {{path, randomTest(path, random)}};
}

bool matches(const std::string& filter_text, const std::shared_ptr<const Schema>& type,
             const Message& message) {
  const Filter filter = Filter::parse(filter_text, Filter::Over::Messages);
  return MessageMatcher(type, filter.root()).matches(message);
}

/// What the whole document answers is right: filter_test holds that to MongoDB's semantics.
TEST(MessageMatcher, agreesWithTheWholeDocumentThoughItReadsOnlyTheFieldsThatAreNamed) {
  Messages random(7);
  const auto type = std::make_shared<const Schema>(schema());
  std::vector<Message> messages(100);
  std::vector<json> documents;
  for (Message& message : messages) {
    random.wander();
    message.bytes = random.next(*type);
    documents.push_back(messageDocument(*type, message));
  }
  int matching = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::string text = randomFilter(random).dump();
    const Filter filter = Filter::parse(text, Filter::Over::Messages);
    const MessageMatcher matcher(type, filter.root());
    for (std::size_t n = 0; n < messages.size(); ++n) {
      ASSERT_EQ(matcher.matches(messages[n]), filter.matches(documents[n]))
          << text << ": " << documents[n].dump();
      matching += filter.matches(documents[n]) ? 1 : 0;
    }
  }
  EXPECT_GT(matching, 20'000);
  EXPECT_LT(matching, 180'000);
}

TEST(MessageMatcher, knowsWhenAMessageCame) {
  Messages random(1);
  const auto type = std::make_shared<const Schema>(schema());
  const Message message{1, Stamp{5}, 7, Stamp{4}, random.next(*type)};
  EXPECT_TRUE(matches(R"({"_meta.stamp_ns": 5, "_meta.sequence": 7})", type, message));
  EXPECT_FALSE(matches(R"({"_meta.header_stamp_ns": 5})", type, message));
}

TEST(MessageMatcher, matchesNothingButTheEmptyFilterWhereBytesAndTypeDoNotFit) {
  Messages random(1);
  const auto type = std::make_shared<const Schema>(schema());
  Message message;
  message.bytes = random.next(*type);
  EXPECT_FALSE(matches(R"({"nothing": {"$exists": false}})", nullptr, message));
  EXPECT_TRUE(matches("{}", nullptr, message));
  EXPECT_TRUE(matches(R"({"nothing": {"$exists": false}})", type, message));
  message.bytes.pop_back();
  EXPECT_FALSE(matches(R"({"nothing": {"$exists": false}})", type, message)) << "cut short";
  EXPECT_TRUE(matches("{}", type, message));
}

}  // namespace
}  // namespace afterglow::replay::message_matcher_test
