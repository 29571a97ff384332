#include "replay/messages/field_edit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "replay/messages/document.hpp"
#include "tests/support/document_fields.hpp"
#include "tests/support/message_definitions.hpp"

namespace afterglow::replay::field_edit_test {
namespace {

template <typename F>
std::string refusal(F&& f) {
  try {
    f();
  } catch (const MessageError& error) {
    return error.what();
  }
  return "";
}

FieldPath path(const std::string& text) { return FieldPath::parse(text); }

/// A TFMessage of as many transforms, with frames "0", "1", ... and stamps in whole seconds.
class TfMessage : public testing::Test {
 protected:
  static Bytes message(const std::vector<std::uint32_t>& seconds) {
    Bytes bytes(4 + seconds.size() * schema_.minimumSize(1));
    bytes[0] = static_cast<std::uint8_t>(seconds.size());
    Value document = decode(schema_, bytes);
    auto& transforms = std::get<Array>(replay::valueAt(document, "transforms"));
    for (std::size_t i = 0; i < seconds.size(); ++i) {
      replay::valueAt(transforms[i], "header.stamp") = RosTime{seconds[i], 0};
      replay::valueAt(transforms[i], "child_frame_id") = std::to_string(i);
    }
    return encode(schema_, document);
  }

  static inline const Schema schema_ = Schema::parse("tf2_msgs/TFMessage", test::kTfMessage);
};

TEST(FieldPath, readsNamesAndIndices) {
  const FieldPath parsed = path("a.b[].c[12]");
  ASSERT_EQ(parsed.steps().size(), 3u);
  EXPECT_EQ(parsed.steps()[0].index, FieldPath::Step::Index::None);
  EXPECT_EQ(parsed.steps()[1].index, FieldPath::Step::Index::Each);
  EXPECT_EQ(parsed.steps()[2].at, 12u);
  EXPECT_EQ(parsed.str(), "a.b[].c[12]");
}

TEST(FieldPath, refusesWhatIsNone) {
  for (const std::string text : {"", ".", "a.", ".a", "a..b", "[]", "a[", "a]", "a[x]", "a[-1]",
                                 "a[1", "a[]b", "a[1]]", "a[99999999999999999999]"}) {
    EXPECT_THROW(path(text), MessageError) << text;
  }
  EXPECT_EQ(refusal([] { path("a[x]"); }), "\"a[x]\" is no field path; expected e.g. a.b[].c[3]");
}

TEST_F(TfMessage, saysWhyAPathDoesNotFit) {
  const auto why = [](const std::string& text) {
    return refusal([&] { findField(schema_, Bytes(4), path(text)); });
  };
  EXPECT_EQ(why("transforms[].stamp"),
            "field path transforms[].stamp of tf2_msgs/TFMessage: geometry_msgs/TransformStamped "
            "has no field stamp");
  EXPECT_EQ(why("transforms"),
            "field path transforms of tf2_msgs/TFMessage: transforms is an array; expected "
            "transforms[] or an index");
  EXPECT_EQ(why("transforms[].header[0]"),
            "field path transforms[].header[0] of tf2_msgs/TFMessage: header is no array");
  EXPECT_EQ(why("transforms[].child_frame_id.x"),
            "field path transforms[].child_frame_id.x of tf2_msgs/TFMessage: child_frame_id is a "
            "string and has no field x");
}

TEST_F(TfMessage, isSearchedElementByElement) {
  const Bytes bytes = message({5, 6, 7});
  EXPECT_EQ(test::stampsAt(schema_, bytes, "transforms[].header.stamp"),
            (std::vector<std::int64_t>{5'000'000'000, 6'000'000'000, 7'000'000'000}));
  EXPECT_EQ(test::stampsAt(schema_, bytes, "transforms[2].header.stamp"),
            (std::vector<std::int64_t>{7'000'000'000}));
  EXPECT_TRUE(findField(schema_, bytes, path("transforms[3].header.stamp")).empty());
  EXPECT_TRUE(findField(schema_, message({}), path("transforms[].header.stamp")).empty());
}

TEST_F(TfMessage, isSearchedForManyPathsInOneWalk) {
  const Bytes bytes = message({5, 6});
  const FieldFinder finder(schema_,
                           {path("transforms[].header.stamp"), path("transforms[1].header.stamp"),
                            path("transforms[0].header"), path("transforms[].child_frame_id")});
  const auto found = finder.find(bytes);
  ASSERT_EQ(found.size(), 4u);
  ASSERT_EQ(found[0].size(), 2u);
  ASSERT_EQ(found[1].size(), 1u);
  EXPECT_EQ(found[1][0].offset, found[0][1].offset);
  EXPECT_EQ(found[2][0].type, FieldType::Message);
  EXPECT_EQ(found[2][0].offset, 4u);
  EXPECT_EQ(found[2][0].size, 16u);
  EXPECT_EQ(readString(bytes, found[3][1]), "1");
}

TEST_F(TfMessage, keepsAllButTheStampThatIsWritten) {
  Bytes bytes = message({5, 6});
  const auto span = findField(schema_, bytes, path("transforms[1].header.stamp")).at(0);
  writeTime(bytes, span, Stamp{1'500'000'000});
  Value expected = decode(schema_, message({5, 6}));
  replay::valueAt(std::get<Array>(replay::valueAt(expected, "transforms"))[1], "header.stamp") =
      RosTime{1, 500'000'000};
  EXPECT_EQ(bytes, encode(schema_, expected));
}

TEST_F(TfMessage, growsAndShrinksWithItsStrings) {
  Bytes bytes = message({5, 6, 7});
  const auto longer = [](const std::string& text) {
    return text == "1" ? text : "robot_2/" + text;
  };
  EXPECT_EQ(editStrings(schema_, bytes, path("transforms[].child_frame_id"), longer), 2u);
  EXPECT_EQ(test::stringAt(schema_, bytes, "transforms[0].child_frame_id"), "robot_2/0");
  EXPECT_EQ(test::stringAt(schema_, bytes, "transforms[1].child_frame_id"), "1");
  EXPECT_EQ(test::stringAt(schema_, bytes, "transforms[2].child_frame_id"), "robot_2/2");
  const auto shorter = [](const std::string& text) { return text.substr(text.size() - 1); };
  EXPECT_EQ(editStrings(schema_, bytes, path("transforms[].child_frame_id"), shorter), 2u);
  EXPECT_EQ(bytes, message({5, 6, 7}));
}

TEST(FieldEdit, findsElementsOfArraysOfEveryKind) {
  const Schema schema =
      Schema::parse("a/B", "time[] t\nstring[] s\nfloat32[2] f\nduration d\nint8 last\n");
  const Value document = Object{{"t", Array{RosTime{1, 0}, RosTime{0, 0}}},
                                {"s", Array{std::string("ab"), std::string()}},
                                {"f", NumberArray{FieldType::Float32, Bytes(8)}},
                                {"d", RosDuration{-1, 5}},
                                {"last", std::int8_t{-2}}};
  Bytes bytes = encode(schema, document);
  EXPECT_EQ(test::stampsAt(schema, bytes, "t[]"), (std::vector<std::int64_t>{1'000'000'000, 0}));
  EXPECT_EQ(test::stringAt(schema, bytes, "s[0]"), "ab");
  EXPECT_EQ(findField(schema, bytes, path("f[1]")).at(0).size, 4u);
  EXPECT_TRUE(findField(schema, bytes, path("f[2]")).empty());
}

TEST(FieldEdit, refusesStampsThatRosTimeCannotHold) {
  Bytes bytes(8);
  const FieldSpan span{FieldType::Time, 0, 8};
  const std::int64_t end = std::int64_t{1'000'000'000} << 32;
  EXPECT_NO_THROW(writeTime(bytes, span, {end - 1}));
  EXPECT_EQ(readTime(bytes, span), Stamp{end - 1});
  EXPECT_EQ(refusal([&] { writeTime(bytes, span, {end}); }),
            "ROS time cannot hold a stamp of 4294967296000000000 ns");
  EXPECT_THROW(writeTime(bytes, span, {-1}), MessageError);
  EXPECT_EQ(readTime(bytes, span), Stamp{end - 1});
}

TEST(FieldEdit, refusesSpansOfAnotherTypeOrMessage) {
  Bytes bytes(8);
  EXPECT_EQ(refusal([&] {
              writeTime(bytes, {FieldType::Duration, 0, 8}, {1});
            }),
            "field at byte 0 is of type duration, not time");
  EXPECT_EQ(refusal([&] {
              writeTime(bytes, {FieldType::Time, 4, 8}, {1});
            }),
            "field at byte 4 lies outside of the message");
  EXPECT_EQ(readTime(bytes, {FieldType::Duration, 0, 8}), std::nullopt);
  EXPECT_THROW(readString(bytes, {FieldType::Time, 0, 8}), MessageError);
}

TEST(FieldEdit, readsTheHeadersStampAlone) {
  const Schema schema = Schema::parse("sensor_msgs/PointCloud2", test::kPointCloud2);
  Value document = test::zeroDocument(schema);
  replay::valueAt(document, "header.stamp") = RosTime{3, 4};
  Bytes bytes = encode(schema, document);
  EXPECT_EQ(headerStamp(schema, bytes), Stamp::fromParts(3, 4));
  bytes.resize(12);  // it is found though the message is cut off behind it
  EXPECT_EQ(headerStamp(schema, bytes), Stamp::fromParts(3, 4));
  bytes.resize(11);
  EXPECT_EQ(refusal([&] { headerStamp(schema, bytes); }),
            "sensor_msgs/PointCloud2: ends within its header");
  EXPECT_EQ(headerStamp(Schema::parse("a/B", "int8 x\nHeader header\n"), Bytes(17)), std::nullopt);
  EXPECT_EQ(headerStamp(Schema::parse("std_msgs/Empty", ""), Bytes()), std::nullopt);
}

}  // namespace
}  // namespace afterglow::replay::field_edit_test
