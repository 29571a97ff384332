#include "replay/motion/stops/operator_stops.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/messages.hpp"

namespace afterglow::replay::stop_field_test {
namespace {

const std::string kState = "my_msgs/State";
/// One byte each: ready, runstopped, inner.closed, and an array behind them.
const std::string kDefinition = test::withTypes(
    "bool ready\nbool runstopped\nInner inner\nbool[] breakers\n", "my_msgs/Inner",
    "bool closed\nuint8 not_boolean\n");

Bytes state(std::uint8_t ready, std::uint8_t runstopped, std::uint8_t closed) {
  return {ready, runstopped, closed, 7, 2, 0, 0, 0, 0, 1};
}

bool stops(const std::string& path, const Bytes& bytes, bool stops_when = true) {
  return StopField(path, stops_when).stops(kState, kDefinition, bytes);
}

std::string refusal(const std::string& path, const std::string& type,
                    const std::string& definition) {
  try {
    StopField(path, true).stops(type, definition, Bytes(20));
    return "";
  } catch (const MessageError& error) {
    return error.what();
  }
}

TEST(StopField, isAnyBooleanOfAnyMessage) {
  EXPECT_TRUE(stops("runstopped", state(0, 1, 0)));
  EXPECT_FALSE(stops("runstopped", state(1, 0, 1)));
  EXPECT_TRUE(stops("inner.closed", state(0, 0, 1)));
  EXPECT_TRUE(stops("breakers[]", state(0, 0, 0))) << "one of two";
}

TEST(StopField, mayStopWhenItIsFalse) {
  EXPECT_TRUE(stops("ready", state(0, 0, 0), false));
  EXPECT_FALSE(stops("ready", state(1, 0, 0), false));
  EXPECT_TRUE(stops("breakers[]", state(1, 1, 1), false)) << "one of two";
}

TEST(StopField, needsNoNameWhereThereIsOneAlone) {
  EXPECT_TRUE(StopField("", true).stops("std_msgs/Bool", "bool data\n", {1}));
  EXPECT_FALSE(StopField("", true).stops("std_msgs/Bool", "bool data\n", {0}));
}

TEST(StopField, isRefusedWithThoseThatThereAre) {
  EXPECT_EQ(refusal("", kState, kDefinition),
            "my_msgs/State has several boolean fields, one of which is to be named: ready, "
            "runstopped, inner.closed, breakers[]");
  EXPECT_EQ(refusal("inner.not_boolean", kState, kDefinition),
            "my_msgs/State has no boolean field inner.not_boolean; it has ready, runstopped, "
            "inner.closed, breakers[]");
  EXPECT_EQ(refusal("data", "std_msgs/String", "string data\n"),
            "std_msgs/String has no boolean field");
}

TEST(StopField, cannotBeReadFromAnEmptyArrayOrFromCutBytes) {
  EXPECT_THROW(stops("breakers[]", {1, 1, 1, 1, 0, 0, 0, 0}), MessageError);
  EXPECT_THROW(stops("runstopped", {1}), MessageError);
}

TEST(StopField, followsATopicWhoseTypeChanges) {
  StopField field("runstopped", true);
  EXPECT_TRUE(field.stops(kState, kDefinition, state(0, 1, 0)));
  EXPECT_TRUE(field.stops("my_msgs/Other", "uint8 first\nbool runstopped\n", {0, 1}));
  EXPECT_THROW(field.stops("std_msgs/Bool", "bool data\n", {1}), MessageError);
  EXPECT_TRUE(field.stops("my_msgs/Other", "uint8 first\nbool runstopped\n", {0, 1}));
  EXPECT_FALSE(field.stops("my_msgs/Other", "uint8 first\nbool runstopped\n", {1, 0}));
}

}  // namespace
}  // namespace afterglow::replay::stop_field_test
