// Which recorded light stays in its place in the world, and where its messages name frames.
#include "replay/plan/anchoring.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/support/messages.hpp"

namespace afterglow::replay::anchoring_test {
namespace {

using namespace test;

Channel ofType(const std::string& topic, const std::string& type) {
  return {topic, type, "", "", false, ""};
}

/// A Header as it is serialized.
Bytes header(std::uint32_t sec, const std::string& frame) {
  Bytes bytes(12, 0);
  bytes[4] = static_cast<std::uint8_t>(sec);
  const Bytes name = text(frame);
  bytes.insert(bytes.end(), name.begin(), name.end());
  return bytes;
}

TEST(AnchorSettings, keepInTheWorldWhatIsDrawnAndLeaveTheRestWithTheRobot) {
  const AnchorSettings settings;
  for (const char* type : {"sensor_msgs/PointCloud2", "visualization_msgs/MarkerArray",
                           "nav_msgs/Path", "geometry_msgs/WrenchStamped"}) {
    EXPECT_EQ(settings.of(ofType("/light", type)), Anchor::World) << type;
  }
  EXPECT_EQ(settings.of(ofType("/said", "std_msgs/String")), Anchor::Body);
  EXPECT_EQ(settings.of(ofType("", "std_msgs/String")), Anchor::Body) << "no topic of ROS";
}

TEST(AnchorSettings, obeyWhatIsSaidOfAllAndOfOneTopic) {
  AnchorSettings settings;
  settings.add("body");
  settings.add("/path=world");
  settings.add("/said=world");
  EXPECT_EQ(settings.of(ofType("/cloud", "sensor_msgs/PointCloud2")), Anchor::Body);
  EXPECT_EQ(settings.of(ofType("/path", "nav_msgs/Path")), Anchor::World);
  EXPECT_EQ(settings.of(ofType("//path/", "nav_msgs/Path")), Anchor::World) << "its clean name";
  EXPECT_EQ(settings.of(ofType("/said", "std_msgs/String")), Anchor::World);
}

TEST(AnchorSettings, refuseOtherWords) {
  for (const char* word : {"floor", "/path=floor", ""}) {
    try {
      AnchorSettings().add(word);
      FAIL() << word;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("is no anchor (world, body, /topic=world"),
                std::string::npos)
          << error.what();
    }
  }
  EXPECT_THROW(AnchorSettings().add("path=world"), std::invalid_argument) << "no topic";
}

TEST(HeaderFields, areFoundAtAnyDepthWithTheirStampsAndFrames) {
  const Schema poses = Schema::parse(
      "my_msgs/Poses", withTypes("Header header\nmy_msgs/Pose[] poses\n", "std_msgs/Header",
                                 kHeader, "my_msgs/Pose", "Header header\nfloat64 x\n"));
  Bytes bytes = header(1, "/map");
  bytes.insert(bytes.end(), {2, 0, 0, 0});
  for (const std::uint32_t sec : {2u, 3u}) {
    const Bytes one = header(sec, "base_link");
    bytes.insert(bytes.end(), one.begin(), one.end());
    bytes.insert(bytes.end(), 8, 0);
  }
  const auto headers = HeaderFields(poses).find(bytes);
  ASSERT_EQ(headers.size(), 3u);
  EXPECT_EQ(headers[0].frame, "map") << "as tf2 has it";
  EXPECT_EQ(headers[0].stamp, Stamp{1'000'000'000});
  EXPECT_EQ(headers[1].frame, "base_link");
  EXPECT_EQ(headers[2].stamp, Stamp{3'000'000'000});
  bytes.pop_back();
  EXPECT_THROW(HeaderFields(poses).find(bytes), MessageError);
}

TEST(HeaderFields, areNoneOfATypeWithoutHeaders) {
  EXPECT_TRUE(HeaderFields(Schema::parse("std_msgs/String", "string data\n")).find({}).empty());
  EXPECT_TRUE(HeaderFields(Schema::parse("std_msgs/Header", kHeader)).find({}).empty())
      << "a header that is the message itself stamps nothing";
}

TEST(RecordedFrame, liesBelowOneNameWithOrWithoutItsSlash) {
  EXPECT_EQ(recordedFrame("base_link"), "recorded/base_link");
  EXPECT_EQ(recordedFrame("/base_link"), "recorded/base_link");
}

}  // namespace
}  // namespace afterglow::replay::anchoring_test
