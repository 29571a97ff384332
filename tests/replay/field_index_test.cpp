#include "replay/store/sqlite/field_blocks.hpp"

#include <gtest/gtest.h>

#include <random>

#include "replay/messages/document.hpp"

namespace afterglow::replay::field_index_test {
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

struct Block {
  FieldBlock block;
  std::vector<json> documents;
};

std::vector<Block> blocks(const FieldSlots& slots, const std::shared_ptr<const FieldSlots>& shared,
                          Messages& random) {
  std::vector<Block> made;
  FieldBlockWriter writer(shared);
  for (int i = 0; i < 40; ++i) {
    random.wander();
    Block block;
    const auto count = 1 + random.pick(12);
    for (std::int64_t n = 0; n < count; ++n) {
      Message message;
      message.bytes = random.next(slots.schema());
      writer.add(message.bytes);
      block.documents.push_back(messageDocument(slots.schema(), message));
    }
    block.block = writer.finish();
    made.push_back(std::move(block));
  }
  return made;
}

std::string_view view(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

bool isRight(Answer answer, std::size_t matching, std::size_t all) {
  return answer == Answer::Maybe || (answer == Answer::None && matching == 0) ||
         (answer == Answer::Some && matching > 0) || (answer == Answer::All && matching == all);
}

TEST(FieldIndex, agreesWithLookingAtEveryMessage) {
  Messages random(7);
  const auto slots = std::make_shared<const FieldSlots>(schema());
  const std::vector<Block> made = blocks(*slots, slots, random);
  int known = 0, asked = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::string text = randomFilter(random).dump();
    const Filter filter = Filter::parse(text, Filter::Over::Messages);
    FieldQuestion question(*slots, filter.root());
    for (const Block& block : made) {
      std::size_t matching = 0;
      for (const json& document : block.documents) matching += filter.matches(document) ? 1 : 0;
      const Answer answer = question.ask(view(block.block.ranges), view(block.block.bloom));
      ASSERT_TRUE(isRight(answer, matching, block.documents.size()))
          << text << ": " << static_cast<int>(answer) << ", " << matching << " of "
          << json(block.documents).dump();
      ++asked;
      known += answer == Answer::Maybe ? 0 : 1;
    }
  }
  EXPECT_GT(known, asked / 2);  // else the index is right but useless
}

Answer ask(const std::string& filter_text, const FieldSlots& slots, const FieldBlock& block) {
  const Filter filter = Filter::parse(filter_text, Filter::Over::Messages);
  return FieldQuestion(slots, filter.root()).ask(view(block.ranges), view(block.bloom));
}

TEST(FieldIndex, answersMaybeForABlockThatItDoesNotUnderstand) {
  Messages random(1);
  const auto slots = std::make_shared<const FieldSlots>(schema());
  FieldBlockWriter writer(slots);
  writer.add(random.next(slots->schema()));
  FieldBlock block = writer.finish();
  EXPECT_EQ(ask(R"({"x": {"$gt": 1e9}})", *slots, block), Answer::None);
  for (std::size_t size = 0; size < block.ranges.size(); ++size) {
    FieldBlock cut{Bytes(block.ranges.begin(), block.ranges.begin() + static_cast<long>(size)), {}};
    EXPECT_NE(ask(R"({"x": {"$exists": true}})", *slots, cut), Answer::Some) << size;
  }
  writer.add(random.next(slots->schema()));
  writer.add({1, 2, 3});  // fits no message
  block = writer.finish();
  EXPECT_EQ(ask(R"({"x": {"$gt": 1e9}})", *slots, block), Answer::Maybe);
}

TEST(FieldIndex, rulesOutAValueThatLiesBetweenOthers) {
  const auto slots =
      std::make_shared<const FieldSlots>(Schema::parse("test/Number", "int32 value\n"));
  FieldBlockWriter writer(slots);
  for (std::int32_t i = 0; i < 256; ++i)
    writer.add(encode(slots->schema(), Object{{"value", 2 * i}}));
  const FieldBlock block = writer.finish();
  EXPECT_EQ(ask(R"({"value": 101})", *slots, block), Answer::None);
  EXPECT_EQ(ask(R"({"value": 100})", *slots, block), Answer::Maybe);
  EXPECT_EQ(ask(R"({"value": {"$gte": 0}})", *slots, block), Answer::All);
  EXPECT_EQ(ask(R"({"value": {"$gt": 509}})", *slots, block), Answer::Some);
  EXPECT_LT(block.ranges.size() + block.bloom.size(), 400u);
}

TEST(FieldIndex, leavesFieldsBehindTheFirstOnesOpen) {
  std::string definition;
  for (int i = 0; i < 300; ++i) definition += "int32 f" + std::to_string(i) + "\n";
  const auto slots = std::make_shared<const FieldSlots>(Schema::parse("test/Many", definition));
  FieldBlockWriter writer(slots);
  writer.add(Bytes(1200, 0));
  const FieldBlock block = writer.finish();
  EXPECT_EQ(ask(R"({"f0": 5})", *slots, block), Answer::None);
  EXPECT_EQ(ask(R"({"f299": 5})", *slots, block), Answer::Maybe);
}

}  // namespace
}  // namespace afterglow::replay::field_index_test
