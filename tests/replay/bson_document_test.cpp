#include "replay/messages/bson_document.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "tests/support/message_corpus.hpp"
#include "tests/support/messages.hpp"
#include "tests/support/random_messages.hpp"

namespace afterglow::replay::bson_document_test {
namespace {

using namespace afterglow::test;

/// A document that is freed.
struct Bson {
  Bson() { bson_init(&bson); }
  explicit Bson(const std::string& json) {
    bson_error_t error;
    if (!bson_init_from_json(&bson, json.data(), static_cast<ssize_t>(json.size()), &error)) {
      throw std::runtime_error(error.message);
    }
  }
  Bson(const Bson&) = delete;
  Bson& operator=(const Bson&) = delete;
  ~Bson() { bson_destroy(&bson); }

  std::string json() const {
    char* text = bson_as_relaxed_extended_json(&bson, nullptr);
    std::string copy = text;
    bson_free(text);
    return copy;
  }
  Bytes bytes() const { return {bson_get_data(&bson), bson_get_data(&bson) + bson.len}; }

  bson_t bson;
};

BsonMessage read(const std::string& definition, const std::string& json) {
  return messageFromBson(Schema::parse("test/Type", definition), Bson(json).bson);
}

/// The bytes of the message in the document.
Bytes bytesOf(const std::string& definition, const std::string& json) {
  const Schema schema = Schema::parse("test/Type", definition);
  return encode(schema, messageFromBson(schema, Bson(json).bson).document);
}

std::string errorOf(const std::string& definition, const std::string& json) {
  try {
    read(definition, json);
  } catch (const MessageError& error) {
    return error.what();
  }
  return "";
}

TEST(BsonDocument, isLaidOutAsMongodbStoreDoes) {
  const Schema schema = Schema::parse(
      "test/Type", withTypes("Header header\nuint8[] data\nfloat32[2] pair\nstring[] names\n"
                             "duration d\nbool yes\nuint32 big\nuint64 most\nOther other\n",
                             "std_msgs/Header", kHeader, "test/Other", "int8 x\n"));
  const Value message =
      Object{{"header", Object{{"seq", std::uint32_t{7}},
                               {"stamp", RosTime{1, 2}},
                               {"frame_id", std::string("m\xC3\xA4p")}}},
             {"data", NumberArray{FieldType::UInt8, {1, 2}}},
             {"pair", NumberArray{FieldType::Float32, {0, 0, 0xC0, 0x3F, 0, 0, 0, 0}}},
             {"names", Array{std::string("a"), std::string("\xFF")}},
             {"d", RosDuration{-1, 5}},
             {"yes", BoolByte{1}},
             {"big", std::uint32_t{4000000000}},
             {"most", std::numeric_limits<std::uint64_t>::max()},
             {"other", Object{{"x", std::int8_t{-3}}}}};
  Bson bson;
  appendBson(message, bson.bson);
  const std::string laid_out =
      R"({ "header" : { "seq" : 7, "stamp" : { "secs" : 1, "nsecs" : 2 }, "frame_id" : )"
      "\"m\xC3\xA4p\""
      R"( }, "data" : { "$binary" : { "base64" : "AQI=", "subType" : "00" } }, )"
      R"("pair" : [ 1.5, 0.0 ], )"
      R"("names" : [ "a", { "$binary" : { "base64" : "/w==", "subType" : "00" } } ], )"
      R"("d" : { "secs" : -1, "nsecs" : 5 }, "yes" : true, "big" : 4000000000, )"
      R"("most" : -1, "other" : { "x" : -3 } })";
  // libbson's blanks are not the same everywhere.
  using Json = nlohmann::ordered_json;
  EXPECT_EQ(Json::parse(bson.json()).dump(), Json::parse(laid_out).dump());
  const BsonMessage back = messageFromBson(schema, bson.bson);
  EXPECT_EQ(encode(schema, back.document), encode(schema, message));
  EXPECT_TRUE(back.missing.empty());
}

TEST(BsonDocument, namesLongArraysByTypeAndCountWhenAsked) {
  const Value message = Object{{"data", NumberArray{FieldType::UInt8, Bytes(5)}},
                               {"few", NumberArray{FieldType::Bool, {1, 0, 2, 1}}}};
  Bson bson;
  appendBson(message, bson.bson, {4});
  EXPECT_EQ(bson.json(), R"({ "data" : { "type" : "uint8", "count" : 5 }, )"
                         R"("few" : [ true, false, 2, true ] })");
}

TEST(BsonDocument, keepsWhatOnlyBitsTellApart) {
  const std::string definition = "bool b\nfloat32 f\nfloat64 d\nstring s\n";
  const Schema schema = Schema::parse("test/Type", definition);
  Bytes bytes = {2,                                           // neither false nor true
                 1, 0, 0xC0, 0xFF,                            // a NaN with a payload
                 1, 0, 0,    0,    0,   0, 0xF8, 0x7F,        // the same
                 5, 0, 0,    0,    'a', 0, 0xC0, 0x80, 'b'};  // NUL, once overlong
  Bson bson;
  appendBson(decode(schema, bytes), bson.bson);
  EXPECT_EQ(encode(schema, messageFromBson(schema, bson.bson).document), bytes);
}

TEST(BsonDocument, readsTheDatesOfTheCppLoggers) {
  const BsonMessage message =
      read(withTypes("Header header\n", "std_msgs/Header", kHeader),
           R"({"_id": 5, "header": {"seq": -1, "stamp": {"$date": {"$numberLong": "1500000000123"}},
               "frame_id": "map"}, "_meta": {"header": 1}})");
  Value document = message.document;
  EXPECT_EQ(stampOf(document, "header.stamp"), Stamp{1500000000123000000});
  EXPECT_EQ(std::get<std::uint32_t>(at(document, "header.seq")), 4294967295u)
      << "they wrote uint32 as int32";
}

TEST(BsonDocument, takesWhatWritersTookForOneAnother) {
  EXPECT_EQ(bytesOf("uint8[3] id\n", R"({"id": "abc"})"), (Bytes{'a', 'b', 'c'}));
  EXPECT_EQ(bytesOf("uint8[] id\n", R"({"id": [1, 2]})"), (Bytes{2, 0, 0, 0, 1, 2}));
  EXPECT_EQ(bytesOf("int16 a\n", R"({"a": 5.0})"), (Bytes{5, 0}));
  EXPECT_EQ(bytesOf("float32 a\n", R"({"a": 1})"), (Bytes{0, 0, 0x80, 0x3F}));
  EXPECT_EQ(bytesOf("float32 a\n", R"({"a": "-inf"})"), (Bytes{0, 0, 0x80, 0xFF}));
  EXPECT_EQ(bytesOf("bool a\n", R"({"a": 1})"), Bytes{1});
  EXPECT_EQ(bytesOf("uint8 a\nuint8 b\n", R"({"b": 2, "a": 1})"), (Bytes{1, 2}));
}

TEST(BsonDocument, zeroesAndNamesWhatIsMissing) {
  const BsonMessage message = read(
      withTypes("Other[] list\nstring s\nOther[2] two\ntime t\n", "test/Other", "int8 x\nint8 y\n"),
      R"({"list": [{"x": 1}, {"x": 2}], "t": null})");
  EXPECT_EQ(message.missing, (std::vector<std::string>{"list[].y", "s", "t", "two"}));
  EXPECT_EQ(toJson(message.document).dump(),
            R"({"list":[{"x":1,"y":0},{"x":2,"y":0}],"s":"","t":{"nsecs":0,"secs":0},)"
            R"("two":[{"x":0,"y":0},{"x":0,"y":0}]})");
}

TEST(BsonDocument, refusesWhatAFieldCannotHold) {
  const auto at_a = [](const std::string& what) {
    return "document of test/Type, field a: " + what;
  };
  EXPECT_EQ(errorOf("uint8 a\n", R"({"a": 256})"), at_a("does not hold 256"));
  EXPECT_EQ(errorOf("uint32 a\n", R"({"a": {"$numberLong": "-1"}})"), at_a("does not hold -1"));
  EXPECT_EQ(errorOf("int8 a\n", R"({"a": 1.5})"), at_a("the number 1.500000 is no integer"));
  EXPECT_EQ(errorOf("int8 a\n", R"({"a": "x"})"), at_a("is a string instead of an integer"));
  EXPECT_EQ(errorOf("float32 a\n", R"({"a": {}})"), at_a("is a document instead of a number"));
  EXPECT_EQ(errorOf("string a\n", R"({"a": [1]})"), at_a("is an array instead of a string"));
  EXPECT_EQ(errorOf("time a\n", R"({"a": 3})"), at_a("is an integer instead of {secs, nsecs}"));
  EXPECT_EQ(errorOf("time a\n", R"({"a": {"secs": 1}})"), at_a("has no nsecs"));
  EXPECT_EQ(errorOf("duration a\n", R"({"a": {"$date": {"$numberLong": "1"}}})"),
            at_a("is a date instead of {secs, nsecs}"));
  EXPECT_EQ(errorOf("int32[2] a\n", R"({"a": [1]})"), at_a("has 1 elements instead of 2"));
  EXPECT_EQ(errorOf("int32[] a\n", R"({"a": {"type": "int32", "count": 70}})"),
            at_a("is a document instead of an array of int32"));
  EXPECT_EQ(errorOf(withTypes("Other[] a\n", "test/Other", "int8 x\n"), R"({"a": [{"x": 999}]})"),
            "document of test/Type, field a[].x: does not hold 999");
}

TEST(BsonDocument, refusesToMakeHugeMessagesOfNothing) {
  EXPECT_EQ(errorOf("int32[4000000000] a\n", "{}"),
            "document of test/Type, field a: too much of the message is missing");
  EXPECT_EQ(errorOf(withTypes("Other[4000000000] a\n", "test/Other", "\n"), "{}"),
            "document of test/Type, field a: too much of the message is missing");
}

void expectToComeBack(const Schema& schema, const Bytes& bytes) {
  Bson bson;
  appendBson(decode(schema, bytes), bson.bson);
  const BsonMessage back = messageFromBson(schema, bson.bson);
  ASSERT_EQ(encode(schema, back.document), bytes) << schema.root().name;
  ASSERT_TRUE(back.missing.empty());
}

TEST(BsonDocument, keepsEveryInstalledTypeByteForByte) {
  const MessageCorpus corpus = makeMessageCorpus(AFTERGLOW_TEST_PYTHON);
  if (corpus.types.empty()) GTEST_SKIP() << AFTERGLOW_TEST_PYTHON " has no ROS messages";
  for (const auto& type : corpus.types) {
    const Schema schema = Schema::parse(type.name, type.definition);
    for (const auto& sample : type.samples) expectToComeBack(schema, sample.bytes);
  }
}

TEST(BsonDocument, keepsRandomTypesByteForByte) {
  RandomMessages random(1);
  for (int i = 0; i < 1000; ++i) {
    const std::string definition = random.definition();
    SCOPED_TRACE(definition);
    const Schema schema = Schema::parse("fuzz/Root", definition);
    expectToComeBack(schema, random.message(schema));
  }
}

TEST(BsonDocument, survivesDamage) {
  const Schema schema = schemaOf(trajectoryGoalChannel("/goal"));
  Bson whole;
  appendBson(decode(schema, goalMessage("id", {0.5, 1.0})), whole.bson);
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 20000; ++i) {
    Bytes damaged = whole.bytes();
    for (int flips = 0; flips < 3; ++flips) {
      damaged[4 + random() % (damaged.size() - 5)] ^= static_cast<std::uint8_t>(1u << random() % 8);
    }
    bson_t bson;
    ASSERT_TRUE(bson_init_static(&bson, damaged.data(), damaged.size()));
    try {
      static_cast<void>(encode(schema, messageFromBson(schema, bson).document));
    } catch (const MessageError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(BsonDocument, doesNotDescendWhereTheSchemaDoesNot) {
  // Documents in documents, a million deep: type, key, length.
  constexpr std::int32_t kDepth = 1'000'000;
  Bytes bytes;
  for (std::int32_t i = 0; i <= kDepth; ++i) {
    const std::int32_t size = 5 + 8 * (kDepth - i);
    for (int shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::uint8_t>(size >> shift));
    }
    if (i < kDepth) bytes.insert(bytes.end(), {0x03, 'a', 0});
  }
  bytes.insert(bytes.end(), kDepth + 1, 0);
  bson_t bson;
  ASSERT_TRUE(bson_init_static(&bson, bytes.data(), bytes.size()));
  const Schema schema =
      Schema::parse("test/Type", withTypes("Other a\n", "test/Other", "int8 b\n"));
  EXPECT_EQ(messageFromBson(schema, bson).missing, std::vector<std::string>{"a.b"});
}

}  // namespace
}  // namespace afterglow::replay::bson_document_test
