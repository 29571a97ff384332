#include "replay/messages/document.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "replay/messages/foreign_json.hpp"
#include "tests/support/document_fields.hpp"
#include "tests/support/message_definitions.hpp"

namespace afterglow::replay::document_test {
namespace {

TEST(ForeignJson, isReadToABoundedDepth) {
  const auto nested = [](std::size_t depth) {
    return "{\"a\": " + std::string(depth, '[') + std::string(depth, ']') + "}";
  };
  EXPECT_TRUE(parseForeignJson(nested(99)).is_object());
  EXPECT_TRUE(parseForeignJson(nested(100)).is_discarded());
  EXPECT_TRUE(parseForeignJson(nested(100'000)).is_discarded());
  EXPECT_TRUE(parseForeignJson(R"({"a": "]]\"[["})").is_object()) << "brackets of a text";
  EXPECT_TRUE(parseForeignJson("{\"a\": 1").is_discarded());
}

Bytes hex(const std::string& digits) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

/// The document of one field, as JSON.
nlohmann::json decoded(const std::string& type, const std::string& bytes) {
  const Schema schema = Schema::parse("a/B", type + " x");
  return toJson(decode(schema, hex(bytes))).at("x");
}

template <typename F>
std::string refusal(F&& f) {
  try {
    f();
  } catch (const MessageError& error) {
    return error.what();
  }
  return "";
}

TEST(Document, readsNumbersLittleEndian) {
  EXPECT_EQ(decoded("int8", "ff"), -1);
  EXPECT_EQ(decoded("byte", "80"), -128);
  EXPECT_EQ(decoded("char", "80"), 128);
  EXPECT_EQ(decoded("uint16", "0102"), 0x0201);
  EXPECT_EQ(decoded("int64", "ffffffffffffff7f"), std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(decoded("uint64", "ffffffffffffffff"), std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(decoded("float32", "0000c03f"), 1.5);
  EXPECT_EQ(decoded("float64", "000000000000f8bf"), -1.5);
  EXPECT_EQ(decoded("bool", "02"), true);
  EXPECT_EQ(decoded("int16[]", "020000000100ffff"), nlohmann::json({1, -1}));
  EXPECT_EQ(decoded("bool[2]", "0001"), nlohmann::json({false, true}));
}

TEST(Document, writesTimesAsMongodbStoreDoes) {
  EXPECT_EQ(decoded("time", "01000000ffffffff"),
            nlohmann::json({{"secs", 1}, {"nsecs", 4294967295u}}));
  EXPECT_EQ(decoded("duration[1]", "ffffffff02000000"),
            nlohmann::json::array({{{"secs", -1}, {"nsecs", 2}}}));
}

TEST(Document, writesNumbersThatJsonLacksAsStrings) {
  EXPECT_EQ(decoded("float64", "000000000000f87f"), "nan");
  EXPECT_EQ(decoded("float32", "0000807f"), "inf");
  EXPECT_EQ(decoded("float32[1]", "000080ff"), nlohmann::json({"-inf"}));
}

TEST(Document, repairsStringsThatAreNoUtf8) {
  const Schema schema = Schema::parse("a/B", "string x");
  const auto repaired = [&](const std::string& bytes) {
    const Bytes content = hex(bytes);
    const Value document = Object{{"x", std::string(content.begin(), content.end())}};
    return toJson(decode(schema, encode(schema, document))).at("x");
  };
  EXPECT_EQ(repaired("c3bc"), "\u00fc");
  EXPECT_EQ(repaired("f09fa496"), "\U0001F916");
  EXPECT_EQ(repaired("61ff62"), "a\ufffdb");
  EXPECT_EQ(repaired("c3"), "\ufffd");                          // cut off
  EXPECT_EQ(repaired("c0af"), "\ufffd\ufffd");                  // overlong
  EXPECT_EQ(repaired("eda080"), "\ufffd\ufffd\ufffd");          // a surrogate
  EXPECT_EQ(repaired("f4908080"), "\ufffd\ufffd\ufffd\ufffd");  // beyond U+10FFFF
  EXPECT_EQ(repaired("e28261"),
            "\ufffd\ufffd"
            "a");
}

TEST(Document, leavesLargeArraysOutOfJson) {
  const Schema schema =
      Schema::parse("a/B", test::withTypes("uint8[] x\nP[] p\nstring[] s\n", "a/P", test::kPoint));
  const Value document = Object{{"x", NumberArray{FieldType::UInt8, Bytes(3, 7)}},
                                {"p", Array(3, Object{})},
                                {"s", Array(3, std::string("a"))}};
  EXPECT_EQ(toJson(document, {3})["x"], nlohmann::json({7, 7, 7}));
  EXPECT_EQ(toJson(document, {2})["x"], nlohmann::json({{"type", "uint8"}, {"count", 3}}));
  EXPECT_EQ(toJson(document, {2})["p"], nlohmann::json({{"type", "message"}, {"count", 3}}));
  EXPECT_EQ(toJson(document, {2})["s"], nlohmann::json({{"type", "string"}, {"count", 3}}));
}

TEST(Document, keepsEveryBit) {
  const auto expectKept = [](const std::string& type, const std::string& bytes) {
    const Schema schema = Schema::parse("a/B", type + " x");
    EXPECT_EQ(encode(schema, decode(schema, hex(bytes))), hex(bytes)) << type;
  };
  expectKept("float32", "010080ff");          // a signaling NaN with payload
  expectKept("float64", "01000000000cf07f");  // the same
  expectKept("float64[]", "0100000001000000000cf07f");
  expectKept("bool", "ff");
  expectKept("bool[]", "020000000203");
  expectKept("string", "02000000fffe");
  expectKept("time", "00000000ffffffff");
  expectKept("duration", "ffffffffffffffff");
}

TEST(Document, refusesToEncodeAnotherShape) {
  const Schema schema = Schema::parse(
      "a/B", test::withTypes("int32 n\nfloat32[2] pair\nP[] points\n", "a/P", test::kPoint));
  const Value good = test::zeroDocument(schema);
  EXPECT_EQ(encode(schema, good).size(), 16u);
  const auto refusalAfter = [&](const std::string& field, Value value) {
    Value bad = good;
    replay::valueAt(bad, field) = std::move(value);
    return refusal([&] { encode(schema, bad); });
  };
  EXPECT_EQ(refusalAfter("n", std::int64_t{1}), "document of a/B, field n: is not of type int32");
  EXPECT_EQ(refusalAfter("pair", NumberArray{FieldType::Float32, Bytes(12)}),
            "document of a/B, field pair: has 3 elements instead of 2");
  EXPECT_EQ(refusalAfter("pair", NumberArray{FieldType::Float64, Bytes(16)}),
            "document of a/B, field pair: is not of type float32[]");
  EXPECT_EQ(refusalAfter("pair", NumberArray{FieldType::Float32, Bytes(9)}),
            "document of a/B, field pair: ends within an element");
  EXPECT_EQ(refusalAfter("points", Array{Object{}}),
            "document of a/B, field points: has 0 fields; a/P has 3");
  EXPECT_EQ(refusal([&] {
              encode(schema, Object{{"n", 1}, {"other", 2}, {"points", Array{}}});
            }),
            "document of a/B, field pair: stands where \"other\" is found");
}

TEST(Document, saysWhereBytesDoNotFit) {
  const Schema schema = Schema::parse("tf2_msgs/TFMessage", test::kTfMessage);
  Bytes bytes(4 + 2 * schema.minimumSize(1));
  bytes[0] = 2;
  Value document = decode(schema, bytes);
  auto& transforms = std::get<Array>(replay::valueAt(document, "transforms"));
  replay::valueAt(transforms[1], "child_frame_id") = std::string("laser_link");
  bytes = encode(schema, document);
  bytes.resize(bytes.size() - 5);
  EXPECT_EQ(refusal([&] { decode(schema, bytes); }),
            "tf2_msgs/TFMessage, field transforms[1].transform.rotation.w, at byte 158: needs 8 "
            "bytes; 3 are left");
  bytes = encode(schema, document);
  bytes.push_back(0);
  EXPECT_EQ(refusal([&] { decode(schema, bytes); }),
            "tf2_msgs/TFMessage, at byte 166: 1 bytes are left behind the message's last field");
  EXPECT_EQ(
      refusal([&] { decode(schema, Bytes(3)); }),
      "tf2_msgs/TFMessage, at byte 0: holds 3 bytes; no message of this type has fewer than 4");
}

}  // namespace
}  // namespace afterglow::replay::document_test
