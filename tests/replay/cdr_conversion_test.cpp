// Messages of ROS 1 as ROS 2's nodes serialize them, and back.
#include "replay/ros2/cdr_conversion.hpp"

#include <gtest/gtest.h>

#include "replay/messages/definitions.hpp"
#include "replay/messages/document.hpp"
#include "tests/support/cdr_bytes.hpp"
#include "tests/support/message_corpus.hpp"
#include "tests/support/random_messages.hpp"

namespace afterglow::replay::cdr_conversion_test {
namespace {

using Cdr = test::CdrBytes;
using test::messageErrorOf;

constexpr const char* kHeader =
    "===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

CdrConversion conversion(const std::string& type, const std::string& ros2, const std::string& ros1,
                         const Ros2Bounds& bounds = {}) {
  return {Schema::parse(type, ros2), Schema::parse(type, ros1), bounds};
}

CdrConversion conversion(const std::string& definition) {
  return conversion("a/B", definition, definition);
}

std::string textOf(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

/// The header {stamp: 7 s, 8 ns; frame_id: "map"} as rclpy of Kilted serializes it.
const std::string kRclpyHeader = "000100000700000008000000040000006d617000";

TEST(CdrConversion, readsAndWritesWhatRclpySerializes) {
  // serialize_message() of Kilted (rmw_fastrtps_cpp), 2026.
  struct Case {
    const char *type, *ros2, *ros1;
    std::string hex, json;
  };
  const std::string pose = std::string("std_msgs/Header header\nTwist twist\n") + kHeader +
                           "===\nMSG: geometry_msgs/Twist\nVector3 linear\nVector3 angular\n"
                           "===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
  const std::string info2 = std::string(
                                "std_msgs/Header header\nuint32 height\nuint32 width\n"
                                "string distortion_model\nfloat64[] d\nfloat64[1] k\n") +
                            kHeader;
  const std::string info1 = std::string(
                                "std_msgs/Header header\nuint32 height\nuint32 width\n"
                                "string distortion_model\nfloat64[] D\nfloat64[1] K\n") +
                            kHeader;
  const std::vector<Case> cases = {
      {"std_msgs/String", "string data\n", "string data\n", "000100000400000068c3a900",
       R"({"data":"hé"})"},
      {"geometry_msgs/TwistStamped", pose.c_str(), pose.c_str(),
       kRclpyHeader + "000000000000e03f" + std::string(80, '0'),
       R"({"header":{"frame_id":"map","seq":0,"stamp":{"nsecs":8,"secs":7}},"twist":{)"
       R"("angular":{"x":0.0,"y":0.0,"z":0.0},"linear":{"x":0.5,"y":0.0,"z":0.0}}})"},
      {"sensor_msgs/CameraInfo", info2.c_str(), info1.c_str(),
       kRclpyHeader + "030000000000000006000000706c756d6200000001000000" + "000000000000e03f" +
           std::string(16, '0'),
       R"({"D":[0.5],"K":[0.0],"distortion_model":"plumb","header":{"frame_id":"map","seq":0,)"
       R"("stamp":{"nsecs":8,"secs":7}},"height":3,"width":0})"}};
  for (const Case& each : cases) {
    SCOPED_TRACE(each.type);
    const CdrConversion both = conversion(each.type, each.ros2, each.ros1);
    const Bytes cdr = test::bytesFromHex(each.hex);
    const Bytes ros1 = both.toRos1(cdr);
    EXPECT_EQ(toJson(decode(Schema::parse(each.type, each.ros1), ros1)).dump(), each.json);
    EXPECT_EQ(both.toRos2(ros1), cdr);
  }
}

TEST(CdrConversion, alignsEveryKindOfFieldBothWays) {
  const CdrConversion both = conversion(
      std::string("std_msgs/Header header\nuint8 a\nfloat64 b\nint16[3] c\nbool d\nuint32[] e\n"
                  "string f\nint64 g\nEmpty h\nduration i\nPair[] j\nfloat64[] none\nint8 k\n"
                  "time[] l\nstring[2] m\n") +
      kHeader + "===\nMSG: a/Empty\n===\nMSG: a/Pair\nfloat64 x\nfloat64 y\n");
  Cdr cdr(false, 0);
  cdr.put<std::int32_t>(7).put<std::uint32_t>(8).text("map");
  cdr.put<std::uint8_t>(1).put(2.5);
  cdr.put<std::int16_t>(-1).put<std::int16_t>(2).put<std::int16_t>(3).put<std::uint8_t>(1);
  cdr.put<std::uint32_t>(2).put<std::uint32_t>(70000).put<std::uint32_t>(1).text("é");
  cdr.put<std::int64_t>(-5).put<std::uint8_t>(0);
  cdr.put<std::int32_t>(-1).put<std::uint32_t>(500);
  cdr.put<std::uint32_t>(2).put(1.0).put(2.0).put(3.0).put(4.0);
  cdr.put<std::uint32_t>(0).put<std::int8_t>(-3);
  cdr.put<std::uint32_t>(1).put<std::uint32_t>(5).put<std::uint32_t>(6).text("").text("x");
  EXPECT_EQ(both.toRos2(both.toRos1(cdr)), static_cast<const Bytes&>(cdr));
}

TEST(CdrConversion, givesBackMessagesOfEveryTypeOfRos1) {
  const test::MessageCorpus corpus = test::makeMessageCorpus(AFTERGLOW_TEST_PYTHON);
  if (corpus.types.empty()) GTEST_SKIP() << AFTERGLOW_TEST_PYTHON " has no ROS messages";
  for (const auto& type : corpus.types) {
    SCOPED_TRACE(type.name);
    const CdrConversion both = conversion(type.name, type.definition, type.definition);
    for (const auto& sample : type.samples) {
      Bytes cdr;
      // Times after 2038 are refused; a header's seq is not sent.
      if (const std::string why = messageErrorOf([&] { cdr = both.toRos2(sample.bytes); });
          !why.empty()) {
        EXPECT_NE(why.find("is a time after 2038, which ROS 2 has not"), std::string::npos) << why;
        continue;
      }
      const Bytes ros1 = both.toRos1(cdr);
      EXPECT_EQ(ros1.size(), sample.bytes.size());
      EXPECT_EQ(both.toRos2(ros1), cdr);
    }
  }
}

TEST(CdrConversion, givesBackMessagesThatNobodyWouldThinkOf) {
  test::RandomMessages random(44);
  int given_back = 0;
  for (int i = 0; i < 300; ++i) {
    const std::string definition = random.definition();
    if (definition.find("[0]") != std::string::npos) continue;  // which ROS 2 has not
    const Schema schema = Schema::parse("fuzz/Root", definition);
    const CdrConversion both(schema, schema);
    const Bytes ros1 = random.message(schema);
    Bytes cdr;
    if (!messageErrorOf([&] { cdr = both.toRos2(ros1); }).empty()) continue;  // after 2038
    ++given_back;
    ASSERT_EQ(both.toRos1(cdr), ros1);
    for (std::size_t size = 0; size < cdr.size(); ++size) {
      const Bytes cut(cdr.begin(), cdr.begin() + static_cast<std::ptrdiff_t>(size));
      messageErrorOf([&] { both.toRos1(cut); });
    }
  }
  EXPECT_GT(given_back, 50);
}

TEST(CdrConversion, findsFieldsOfAnotherOrderBothWays) {
  const CdrConversion both = conversion(
      "a/B", "string s\nuint8 small\nfloat64[] many\nP p\n===\nMSG: a/P\nint32 x\nint8 y\n",
      "P p\nfloat64[] many\nstring s\nuint8 small\n===\nMSG: a/P\nint8 y\nint32 x\n");
  Cdr cdr(false, 0);
  cdr.text("ab")
      .put<std::uint8_t>(3)
      .put<std::uint32_t>(1)
      .put(0.5)
      .put<std::int32_t>(-2)
      .put<std::int8_t>(9);
  const Bytes ros1 = both.toRos1(cdr);
  EXPECT_EQ(toJson(decode(Schema::parse("a/B",
                                        "P p\nfloat64[] many\nstring s\nuint8 small\n"
                                        "===\nMSG: a/P\nint8 y\nint32 x\n"),
                          ros1))
                .dump(),
            R"({"many":[0.5],"p":{"x":-2,"y":9},"s":"ab","small":3})");
  EXPECT_EQ(both.toRos2(ros1), static_cast<const Bytes&>(cdr));
}

TEST(CdrConversion, writesZerosForWhatOnlyRos2Draws) {
  const CdrConversion both = conversion(
      "visualization_msgs/Marker",
      std::string(
          "int32 id\nTexture[2] textures\nuint8[] data\nfloat64 size\nstring s\n"
          "std_msgs/Header at\n===\nMSG: visualization_msgs/Texture\nstring name\nfloat64 w\n") +
          kHeader,
      "string s\nint32 id\n");
  Cdr cdr(false, 0);
  cdr.put<std::int32_t>(4).text("").put(0.0).text("").put(0.0).put<std::uint32_t>(0).put(0.0);
  cdr.text("x").put<std::int32_t>(0).put<std::uint32_t>(0).text("");
  const Bytes ros1 = both.toRos1(cdr);
  EXPECT_EQ(textOf(ros1), std::string("\x01\0\0\0x\x04\0\0\0", 9));
  EXPECT_EQ(both.toRos2(ros1), static_cast<const Bytes&>(cdr));
}

TEST(CdrConversion, refusesWhatRos2HasNotByFieldAndByte) {
  Ros2Bounds bounds;
  const std::string definition =
      ros1Definition("a/msg/B", "string<=3[<=2] names\nuint8[<=4] bytes\ntime at\n", &bounds);
  const CdrConversion bounded = conversion("a/B", definition, definition, bounds);
  const Schema schema = Schema::parse("a/B", definition);
  const auto said = [&](const std::vector<std::string>& names, std::size_t bytes,
                        std::uint32_t at) {
    Array array(names.begin(), names.end());
    const Object message = {{"names", std::move(array)},
                            {"bytes", NumberArray{FieldType::UInt8, Bytes(bytes)}},
                            {"at", RosTime{at, 0}}};
    const Bytes ros1 = encode(schema, message);
    return messageErrorOf([&] { bounded.toRos2(ros1); });
  };
  EXPECT_EQ(said({"abc", ""}, 4, 0x7fffffff), "");
  EXPECT_EQ(said({"abc", "abcd"}, 0, 0),
            "a/B, field names[1], at byte 19: has 4 letters; ROS 2 takes 3");
  EXPECT_EQ(said({"", "", ""}, 0, 0),
            "a/B, field names[0], at byte 4: has 3 elements; ROS 2 takes 2");
  EXPECT_EQ(said({}, 5, 0), "a/B, field bytes[0], at byte 8: has 5 elements; ROS 2 takes 4");
  EXPECT_EQ(said({}, 0, 0x80000000),
            "a/B, field at, at byte 12: is a time after 2038, which ROS 2 has not");
  EXPECT_EQ(messageErrorOf([&] {
              bounded.toRos2({1, 0, 0, 0});
            }),
            "a/B, at byte 0: holds 4 bytes; no message of this type has fewer than 16");
}

TEST(CdrConversion, hasNoArraysOfNoElements) {
  EXPECT_EQ(messageErrorOf([] { conversion("int32[0] x\n"); }),
            "field x is an array of no elements, which ROS 2 has not");
}

TEST(Ros2Definition, isWrittenFromOneOfRos1AndReadAgain) {
  const std::string ros1 =
      "uint8 MOST=3 # so many\nstring SAID=\"a\" # b\nHeader header\ntime[] times\n"
      "byte b\nfloat64[9] K # of the lens\nP p\n" +
      std::string(kHeader) + "===\nMSG: sensor_msgs/P\nduration d\nbool X=True\n";
  const std::string line(80, '=');
  EXPECT_EQ(ros2Definition("sensor_msgs/CameraInfo", ros1),
            "uint8 MOST=3\nstring SAID='\"a\" # b'\nstd_msgs/Header header\n"
            "builtin_interfaces/Time[] times\nint8 b\nfloat64[9] k\nP p\n" +
                line + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" +
                line + "\nMSG: sensor_msgs/P\nbuiltin_interfaces/Duration d\nbool X=True\n" + line +
                "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" + line +
                "\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n");
  const test::MessageCorpus corpus = test::makeMessageCorpus(AFTERGLOW_TEST_PYTHON);
  if (corpus.types.empty()) GTEST_SKIP() << AFTERGLOW_TEST_PYTHON " has no ROS messages";
  int same = 0;
  for (const auto& type : corpus.types) {
    SCOPED_TRACE(type.name);
    const std::string text =
        ros1Definition(ros2TypeName(type.name), ros2Definition(type.name, type.definition));
    const Schema schema = Schema::parse(type.name, text);
    EXPECT_EQ(schema.minimumSize(0), Schema::parse(type.name, type.definition).minimumSize(0));
    same += definitionMd5(type.name, text) == type.md5 ? 1 : 0;
  }
  // The others have fields that ROS 2 renames, or `byte` and `char`, which it has otherwise.
  EXPECT_GE(same, static_cast<int>(corpus.types.size()) - 20);
}

TEST(Ros2Definition, tellsItsBounds) {
  Ros2Bounds bounds;
  ros1Definition("a/msg/B",
                 "# string<=1 not\nstring<=10 name\nint8[<=5] few\nstring<=2[3] both 'x'\nC c\n"
                 "int32 MOST=4\n===\nMSG: a/C\nfloat64[<=7] x\n",
                 &bounds);
  ASSERT_EQ(bounds.size(), 4u);
  EXPECT_EQ(bounds.at({"a/B", "name"}).letters, 10u);
  EXPECT_EQ(bounds.at({"a/B", "few"}).elements, 5u);
  EXPECT_EQ(bounds.at({"a/B", "both"}).letters, 2u);
  EXPECT_EQ(bounds.at({"a/B", "both"}).elements, 0u);
  EXPECT_EQ(bounds.at({"a/C", "x"}).elements, 7u);
}

}  // namespace
}  // namespace afterglow::replay::cdr_conversion_test
