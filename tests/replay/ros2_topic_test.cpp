// Topics of ROS 2 as those of ROS 1: definitions, serialized messages, types that differ.
#include "replay/ros2/ros2_topic.hpp"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "replay/messages/document.hpp"
#include "replay/ros2/ros2_definition.hpp"
#include "tests/support/cdr_bytes.hpp"

namespace afterglow::replay::ros2_topic_test {
namespace {

constexpr const char* kHeaderText =
    "================================================================================\n"
    "MSG: std_msgs/msg/Header\n"
    "builtin_interfaces/Time stamp\nstring frame_id\n"
    "================================================================================\n"
    "MSG: builtin_interfaces/msg/Time\nint32 sec\nuint32 nanosec\n";

using Cdr = test::CdrBytes;
using test::messageErrorOf;

/// Knows the types of this map.
FindDefinition knows(std::map<std::string, std::string> texts) {
  return [texts](const std::string& type) -> std::optional<Definition> {
    const auto found = texts.find(type);
    if (found == texts.end()) return std::nullopt;
    return Definition{found->second, definitionMd5(type, found->second)};
  };
}

Ros2Description described(const std::string& type, const std::string& definition) {
  return {"/topic", type, "cdr", "ros2msg", definition, ""};
}

/// The ROS 1 message as JSON.
std::string jsonOf(Ros2Topic& topic, const Bytes& cdr) {
  const Schema schema = Schema::parse(topic.channel().type, topic.channel().definition);
  return toJson(decode(schema, topic.toRos1(cdr))).dump();
}

TEST(Ros2Definition, becomesOneOfRos1) {
  EXPECT_EQ(ros1Definition("my_msgs/msg/All",
                           "# A comment.\n"
                           "uint8 SMALL = 3  # a constant\n"
                           "string NAME=\"a # b\"\n"
                           "bool SURE=true\n"
                           "std_msgs/Header header\n"
                           "builtin_interfaces/Time[] times\n"
                           "builtin_interfaces/msg/Duration left\n"
                           "string<=10 name \"none # yet\"\n"
                           "string<=10[<=5] names\n"
                           "float64[<=3] sizes [1.0, 2.0]\n"
                           "float32[9] matrix\n"
                           "Part[] parts\n"
                           "geometry_msgs/msg/Point at   # where\n" +
                               std::string(kHeaderText) +
                               "=====\nMSG: my_msgs/Part\nfloat64 w 1\n"
                               "=====\nMSG: geometry_msgs/msg/Point\nfloat64 x\n"),
            "uint8 SMALL=3\nstring NAME=a # b\nbool SURE=True\nstd_msgs/Header header\n"
            "time[] times\n"
            "duration left\nstring name\nstring[] names\nfloat64[] sizes\nfloat32[9] matrix\n"
            "Part[] parts\ngeometry_msgs/Point at\n" +
                std::string(80, '=') +
                "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n" +
                std::string(80, '=') + "\nMSG: my_msgs/Part\nfloat64 w\n" + std::string(80, '=') +
                "\nMSG: geometry_msgs/Point\nfloat64 x\n");
  EXPECT_EQ(ros1Definition("std_msgs/msg/Empty", "uint8 structure_needs_at_least_one_member\n"),
            "");
}

TEST(Ros2Definition, saysWhatRos1HasNot) {
  const auto said = [](const std::string& type, const std::string& text) {
    return messageErrorOf([&] { ros1Definition(type, text); });
  };
  EXPECT_EQ(said("a/msg/B", "wstring text"),
            "definition of a/B: \"wstring text\" has wide letters, which ROS 1 has not");
  EXPECT_EQ(said("a/msg/B", "int32[0] x"),
            "definition of a/B: \"int32[0] x\" is an array of no elements, which ROS 2 has not");
  EXPECT_EQ(said("a/srv/B_Event", "int32 x\n---\nint32 y"),
            "definition of a/B_Event: \"---\" is of a service or an action, not of a message");
  EXPECT_EQ(said("a/msg/B", "int32"), "definition of a/B: \"int32\" is no field");
  EXPECT_EQ(said("a/msg/B", "int32 x\n===\nIDL: a/msg/C"),
            "definition of a/B: \"IDL: a/msg/C\" stands where \"MSG: package/Type\" should");
  EXPECT_EQ(said("no type", ""), "\"no type\" is no message type; expected package/msg/Type");
  EXPECT_EQ(said("a/msg/B", "std_msgs/Header h\n===\nMSG: std_msgs/Header\nint32 seq\n"),
            "definition of std_msgs/Header: it has other fields than in ROS 2");
}

TEST(Ros2Topic, alignsNumbersBehindTheHeaderInBothByteOrders) {
  for (const bool is_big : {false, true}) {
    Ros2Topic topic(described("my_msgs/msg/Mixed",
                              "std_msgs/Header header\nuint8 a\nfloat64 b\nint16[3] c\n"
                              "bool d\nuint32[] e\nstring f\nint64 g\nEmpty h\n"
                              "builtin_interfaces/Duration i\nPair[] j\nfloat64[] none\nint8 k\n" +
                                  std::string(kHeaderText) +
                                  "===\nMSG: my_msgs/Empty\n===\nMSG: my_msgs/Pair\nfloat64 x\n"
                                  "float64 y\n"),
                    knows({}));
    Cdr cdr(is_big);
    cdr.put<std::int32_t>(7).put<std::uint32_t>(8).text("map");
    cdr.put<std::uint8_t>(1).put(2.5);
    cdr.put<std::int16_t>(-1).put<std::int16_t>(2).put<std::int16_t>(3).put<std::uint8_t>(1);
    cdr.put<std::uint32_t>(2).put<std::uint32_t>(70000).put<std::uint32_t>(1).text("é");
    cdr.put<std::int64_t>(-5).put<std::uint8_t>(0);
    cdr.put<std::int32_t>(-1).put<std::uint32_t>(500);
    cdr.put<std::uint32_t>(2).put(1.0).put(2.0).put(3.0).put(4.0);
    cdr.put<std::uint32_t>(0).put<std::int8_t>(-3);
    EXPECT_EQ(jsonOf(topic, cdr),
              R"({"a":1,"b":2.5,"c":[-1,2,3],"d":true,"e":[70000,1],"f":"é","g":-5,"h":{},)"
              R"("header":{"frame_id":"map","seq":0,"stamp":{"nsecs":8,"secs":7}},)"
              R"("i":{"nsecs":500,"secs":-1},"j":[{"x":1.0,"y":2.0},{"x":3.0,"y":4.0}],"k":-3,)"
              R"("none":[]})");
  }
}

TEST(Ros2Topic, refusesBytesThatAreNoMessage) {
  Ros2Topic topic(described("my_msgs/msg/T", "builtin_interfaces/Time at\nstring s\nint32[] n\n"),
                  knows({}));
  const auto said = [&](const Bytes& bytes) {
    return messageErrorOf([&] { topic.toRos1(bytes); });
  };
  const auto begun = [] { return Cdr().put<std::int32_t>(1).put<std::uint32_t>(0); };
  EXPECT_EQ(said({}), "my_msgs/T, at byte 0: is not serialized as ROS 2's nodes do (CDR, version "
                      "1)");
  EXPECT_EQ(said({0, 7, 0, 0}),
            "my_msgs/T, at byte 0: is not serialized as ROS 2's nodes do (CDR, version 1)");
  EXPECT_EQ(said({0, 1, 0, 0}), "my_msgs/T, field at, at byte 4: needs 4 bytes; 0 are left");
  EXPECT_EQ(said(Cdr().put<std::int32_t>(-1).put<std::uint32_t>(0)),
            "my_msgs/T, field at, at byte 8: is a time before 1970, which ROS 1 has not");
  EXPECT_EQ(said(begun().put<std::uint32_t>(900)),
            "my_msgs/T, field s, at byte 16: needs 900 bytes; 0 are left");
  EXPECT_EQ(said(begun().put<std::uint32_t>(1).put<std::uint8_t>('x')),
            "my_msgs/T, field s, at byte 17: is a string that does not end");
  EXPECT_EQ(said(begun().text("").put<std::uint32_t>(0xffffffff)),
            "my_msgs/T, field n, at byte 24: counts 4294967295 elements; 0 bytes are left");
  EXPECT_EQ(said(begun().text("").put<std::uint32_t>(2).put<std::int32_t>(1)),
            "my_msgs/T, field n, at byte 24: counts 2 elements of 4 bytes; 4 are left");
}

TEST(Ros2Topic, refusesBytesBehindAMessageWhereItsDefinitionIsAGuess) {
  const Bytes four = Cdr().text("abc").put<std::uint32_t>(0);
  const auto find = knows({{"std_msgs/String", "string data\n"}});
  Ros2Topic own(described("std_msgs/msg/String", "string data\n"), find);
  EXPECT_EQ(jsonOf(own, four), R"({"data":"abc"})") << "as rclpy's serialize_message() leaves them";
  Ros2Topic guessed({"/t", "std_msgs/msg/String", "cdr", "", "", ""}, find);
  EXPECT_EQ(messageErrorOf([&] { guessed.toRos1(four); }),
            "std_msgs/String, at byte 12: 4 bytes are left behind the message's last field");
  EXPECT_EQ(jsonOf(guessed, Cdr().text("abc").put<std::uint8_t>(0)), R"({"data":"abc"})")
      << "padding is no message";
}

TEST(Ros2Topic, isRos1sWhereTheFieldsAre) {
  const std::string ros1 = "# As ROS 1 says it.\nfloat64 x\nfloat64 y\nfloat64 z\n";
  Ros2Topic topic(described("geometry_msgs/msg/Point", "float64 x 0\nfloat64 y 0\nfloat64 z 0\n"),
                  knows({{"geometry_msgs/Point", ros1}}));
  EXPECT_EQ(topic.channel().type, "geometry_msgs/Point");
  EXPECT_EQ(topic.channel().md5, "4a842b65f413084dc2b10fb484ea7f17");
  EXPECT_EQ(topic.channel().definition, ros1);
  EXPECT_EQ(topic.whyForeign(), "");
}

TEST(Ros2Topic, dropsWhatNobodyDrawsAndFollowsNewNames) {
  Ros2Topic marker(described("visualization_msgs/msg/Marker",
                             "int32 id\nstring texture\nstring s\n"),
                   knows({{"visualization_msgs/Marker", "int32 ARROW=0\nstring s\nint32 id\n"}}));
  EXPECT_EQ(marker.whyForeign(), "");
  EXPECT_EQ(jsonOf(marker, Cdr().put<std::int32_t>(4).text("no").text("x")),
            R"({"id":4,"s":"x"})");
  Ros2Topic camera(described("sensor_msgs/msg/CameraInfo", "float64[] d\nfloat64[2] k\n"),
                   knows({{"sensor_msgs/CameraInfo", "float64[] D\nfloat64[2] K\n"}}));
  EXPECT_EQ(jsonOf(camera, Cdr().put<std::uint32_t>(1).put(0.5).put(1.0).put(2.0)),
            R"({"D":[0.5],"K":[1.0,2.0]})");
}

TEST(Ros2Topic, keepsItsOwnFieldsWhereRos1HasOthers) {
  const auto why = [](const std::string& ros2, const std::string& ros1) {
    const Ros2Topic topic(described("a/msg/B", ros2), knows({{"a/B", ros1}}));
    EXPECT_EQ(whyForeign(topic.channel().definition), topic.whyForeign());
    EXPECT_EQ(topic.channel().md5, definitionMd5("a/B", topic.channel().definition));
    return topic.whyForeign();
  };
  EXPECT_EQ(why("int32 x\nint32 y\n", "int32 x\n"), "ROS 1 has no field y");
  EXPECT_EQ(why("int32 x\n", "int32 x\nint32 y\n"), "ROS 2 has no field y");
  EXPECT_EQ(why("float64 x\n", "float32 x\n"), "field x is of another type in ROS 2");
  EXPECT_EQ(why("C c\n===\nMSG: a/C\nint32[2] x\n", "C c\n===\nMSG: a/C\nint32[3] x\n"),
            "field c.x is of another type in ROS 2");
  EXPECT_EQ(Ros2Topic(described("a/msg/B", "int32 x\n"), knows({})).whyForeign(),
            "no ROS 1 type a/B is known here");
}

TEST(Ros2Topic, knowsCommonTypesWithoutADefinition) {
  const auto find = knows({{"std_msgs/String", "string data\n"},
                           {"std_msgs/Time", "time data\n"},
                           {"my_msgs/Own", "int32 x\n"}});
  Ros2Description description{"/t", "std_msgs/msg/String", "cdr", "", "", ""};
  Ros2Topic text(description, find);
  EXPECT_EQ(jsonOf(text, Cdr().text("hello")), R"({"data":"hello"})");
  const auto said = [&](const std::string& type, const std::string& kind) {
    description.type = type;
    description.definition_kind = kind;
    return messageErrorOf([&] { Ros2Topic(description, find); });
  };
  EXPECT_EQ(said("my_msgs/msg/Own", ""),
            "the bag has no definition of its type, and it is not known to have ROS 1's fields");
  EXPECT_EQ(said("my_msgs/msg/Other", "ros2idl"),
            "its type is defined as \"ros2idl\"; ros2msg is read, and ROS 1 knows none here");
  EXPECT_EQ(said("std_msgs/msg/Time", ""),
            "the bag has no definition of its type, and it is not known to have ROS 1's fields");
  description.serialization = "protobuf";
  EXPECT_EQ(messageErrorOf([&] { Ros2Topic(description, find); }),
            "its messages are serialized as \"protobuf\"; cdr is read");
}

TEST(Ros2Topic, isLatchedWhereLateSubscribersGetTheLast) {
  const auto is_latched = [](const std::string& quality) {
    Ros2Description description = described("a/msg/B", "int32 x\n");
    description.quality = quality;
    return Ros2Topic(description, knows({})).channel().latching;
  };
  EXPECT_FALSE(is_latched(""));
  EXPECT_FALSE(is_latched("- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n"));
  EXPECT_TRUE(is_latched("- history: 1\n  durability: 2\n- history: 1\n  durability: 1\n"));
  EXPECT_TRUE(is_latched("- {history: keep_last, durability: transient_local}"));
  EXPECT_FALSE(is_latched("- durability: volatile\n  durability:"));
}

TEST(Ros2Topic, ofARobotIsItsOwnWhereRos1KnowsNone) {
  Ros2Topic topic(described("my_msgs/msg/Own", "int32 x\nstring<=3 name\n"), knows({}),
                  Ros2Topic::Source::Robot);
  EXPECT_EQ(topic.whyForeign(), "");
  EXPECT_EQ(whyForeign(topic.channel().definition), std::nullopt);
  EXPECT_EQ(jsonOf(topic, Cdr().put(7).text("abc")), R"({"name":"abc","x":7})");
}

TEST(Ros2Topic, ofARobotHasRos1sFieldsWhereNobodyTellsOthers) {
  Ros2Description description = described("my_msgs/msg/Own", "");
  description.definition_kind = "";
  Ros2Topic topic(description, knows({{"my_msgs/Own", "int32 x\n"}}), Ros2Topic::Source::Robot);
  EXPECT_EQ(jsonOf(topic, Cdr().put(7)), R"({"x":7})");
  EXPECT_EQ(messageErrorOf([&] { topic.toRos1(Cdr().put(7).put(8)); }).empty(), false);
  EXPECT_EQ(messageErrorOf([&] { Ros2Topic(description, knows({}), Ros2Topic::Source::Robot); }),
            "no node of ROS 2 tells its type, and ROS 1 knows none here");
}

TEST(Ros2Topic, goesBackToRos2AsItCame) {
  Ros2Topic topic(described("my_msgs/msg/Own",
                            "std_msgs/Header header\nstring<=3 name\n" + std::string(kHeaderText)),
                  knows({}), Ros2Topic::Source::Robot);
  const Bytes cdr = Cdr(false, 0).put(5).put(std::uint32_t{6}).text("map").text("abc");
  EXPECT_EQ(topic.toRos2(topic.toRos1(cdr)), cdr);
  Bytes longer = topic.toRos1(cdr);
  longer[longer.size() - 7] = 4;  // of the string's length
  longer.push_back('d');
  EXPECT_NE(messageErrorOf([&] { topic.toRos2(longer); }), "");
}

}  // namespace
}  // namespace afterglow::replay::ros2_topic_test
