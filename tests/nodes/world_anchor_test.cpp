// Frames of recorded light are told to today's tf where they were.
#include <gtest/gtest.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/LaserScan.h>

#include "nodes/player/world_anchor.hpp"
#include "tests/support/anchored_world.hpp"

namespace afterglow::nodes::world_anchor_test {
namespace {

using test::rosBytes;
using test::rosChannel;
using WorldAnchorTest = test::AnchoredWorld;

TEST_F(WorldAnchorTest, putsFramesWhereTheyWereAtTheMessagesOwnStamp) {
  recordDrive();
  sensor_msgs::LaserScan scan;
  scan.header.frame_id = "/laser";
  scan.header.stamp = toTime(recordedAt(1007));
  record(rosChannel<sensor_msgs::LaserScan>("/scan"), 1050, rosBytes(scan));
  nav_msgs::Path path;
  path.header.frame_id = "map";
  path.poses.resize(2);
  path.poses[1].header = scan.header;
  record(rosChannel<nav_msgs::Path>("/path"), 1050, rosBytes(path));
  EXPECT_TRUE(playAnchored(2000).is_complete);
  EXPECT_TRUE(is_needed);
  const auto light = sent<sensor_msgs::LaserScan>("/scan").header;
  EXPECT_EQ(light.frame_id, "recorded/laser");
  EXPECT_LT(distance(placed(light), T_map_base(1007) * planar(0.2, 0, 5, 0.3)), 1e-4);
  const auto way = sent<nav_msgs::Path>("/path");
  EXPECT_EQ(way.header.frame_id, "map") << "the anchor is where it was";
  EXPECT_EQ(way.poses[0].header.frame_id, "");
  EXPECT_EQ(way.poses[1].header.frame_id, "recorded/laser");
}

TEST_F(WorldAnchorTest, stampsWhatHasNoStampSoThatSeveralMomentsCanBeShownAtOnce) {
  recordDrive();
  for (const int ms : {500, 1500}) {
    Marker marker = disk("base_link", 0, 0, {});
    marker.id = ms;
    recordMarker(ms, marker);
  }
  plan_options.start_s = 2;  // both are shown at once, at the start
  EXPECT_TRUE(playAnchored(2500).is_complete);
  ASSERT_EQ(sink.on("/marker").size(), 2u);
  EXPECT_LT(distance(placed(sent<Marker>("/marker", 0).header), T_map_base(500)), 1e-4);
  EXPECT_LT(distance(placed(sent<Marker>("/marker", 1).header), T_map_base(1500)), 1e-4);
}

TEST_F(WorldAnchorTest, leavesFramesAsTheyAreWhereTheBodyIsTheAnchor) {
  recordDrive();
  recordMarker(1000, disk("base_link", 0, 0, recordedAt(1000)));
  record(rosChannel<nav_msgs::Path>("/path"), 1100, rosBytes(nav_msgs::Path()));
  replay::AnchorSettings settings;
  settings.add("/marker=body");
  EXPECT_TRUE(playAnchored(2000, settings).is_complete);
  EXPECT_FALSE(is_needed);
  EXPECT_EQ(sent<Marker>("/marker").header.frame_id, "base_link");
  EXPECT_THROW(settings.add("/marker=floor"), std::invalid_argument);
  EXPECT_THROW(settings.add("marker=body"), std::invalid_argument);
}

TEST(AnchorSettings, leaveARobotsStateWithItUnlessATopicsNameSaysThatItIsLight) {
  const auto anchorOf = [](const std::string& topic) {
    return replay::AnchorSettings().of({topic, "nav_msgs/Odometry", "", "", false, ""});
  };
  EXPECT_EQ(anchorOf("/odom"), replay::Anchor::Body);
  EXPECT_EQ(anchorOf("/projector/odom"), replay::Anchor::World);
}

TEST_F(WorldAnchorTest, refusesATopicOfWhichNobodyKnowsWhereItWas) {
  recordDrive(0, 3000, "elsewhere");
  recordMarker(1000, disk("base_link", 0, 0, recordedAt(1000)));
  Marker known = disk("map", 0, 0, {});
  record(rosChannel<Marker>("/known"), 1000, rosBytes(known));
  EXPECT_TRUE(playAnchored(2000).is_complete);
  EXPECT_TRUE(sink.on("/marker").empty());
  EXPECT_EQ(sink.on("/known").size(), 1u);
  const std::string why = plan.topics.at(1).why_not;
  EXPECT_NE(why.find("where its frame 'base_link' was in 'map'"), std::string::npos) << why;
}

TEST_F(WorldAnchorTest, placesATopicByItsOwnStampOrWhereItHasNoneByWhenItCame) {
  recordDrive(5000, 6000);
  recordMarker(1000, disk("base_link", 0, 0, {}));
  record(rosChannel<Marker>("/late"), 9500, rosBytes(disk("base_link", 0, 0, recordedAt(5500))));
  EXPECT_TRUE(playAnchored(10'000).is_complete);
  EXPECT_TRUE(sink.on("/marker").empty()) << "tf had not begun";
  EXPECT_EQ(sink.on("/late").size(), 1u);
}

TEST_F(WorldAnchorTest, leavesDarkWhatCannotBePlacedAndSaysSo) {
  recordDrive(0, 1000);
  recordMarker(500, disk("base_link", 0, 0, recordedAt(500)));
  recordMarker(1900, disk("base_link", 0, 0, recordedAt(1900)));  // tf had ended by then
  EXPECT_TRUE(playAnchored(2000).is_complete);
  ASSERT_EQ(sink.on("/marker").size(), 2u);
  EXPECT_NO_THROW(placed(sent<Marker>("/marker", 0).header));
  EXPECT_THROW(placed(sent<Marker>("/marker", 1).header), std::exception);
  ASSERT_EQ(anchor->notes().size(), 1u);
  EXPECT_NE(anchor->notes()[0].find("'base_link' was in 'map' for 1 messages"), std::string::npos);
}

TEST_F(WorldAnchorTest, tellsAgainWhereFramesInUseAreAsTheRecordingGoesOn) {
  recordDrive(0, 120'000);
  recordMarker(1000, disk("base_link", 0, 0, recordedAt(1000)));
  EXPECT_TRUE(playAnchored(110'000).is_complete);
  for (const int ms : {1800, 100'000, 300}) {  // on, far on, and back
    const replay::Stamp now{test::kBegin * 2 + 900'000 * test::kMs + ms};
    anchor->repeat(recordedAt(ms), now);
    std_msgs::Header header;
    header.frame_id = "recorded/base_link";
    header.stamp = toTime(now);
    EXPECT_LT(distance(placed(header), T_map_base(ms)), 1e-4) << ms;
  }
}

/// Recorded transforms, asked without a replay.
struct RecordedFramesTest : test::AnchoredWorld {
  /// Of a behavior of this length.
  RecordedFrames frames(int length_ms) {
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.begin = recordedAt(0);
    behavior.end = recordedAt(length_ms);
    return {*store, behavior, "map"};
  }
  /// Heard so long after its own stamp.
  void recordBase(int ms, int late_ms, const std::string& topic = "/tf") {
    tf2_msgs::TFMessage message;
    message.transforms = {stamped("map", "base_link", T_map_base(ms), recordedAt(ms))};
    record(rosChannel<tf2_msgs::TFMessage>(topic), ms + late_ms, rosBytes(message));
  }
  static bool knows(RecordedFrames& frames, double ms, RecordedFrames::Wanted wanted) {
    return frames.at("base_link", recordedAt(ms), wanted).has_value();
  }
  static constexpr auto kExact = RecordedFrames::Wanted::Exact;
  static constexpr auto kNewest = RecordedFrames::Wanted::Newest;
};

TEST_F(RecordedFramesTest, areTakenForTwoSecondsWhereTheNewestWillDo) {
  recordDrive(0, 1000);
  RecordedFrames frames = this->frames(10'000);
  EXPECT_TRUE(knows(frames, 1000, kExact));
  EXPECT_FALSE(knows(frames, 1001, kExact));
  EXPECT_TRUE(knows(frames, 3000, kNewest));
  EXPECT_FALSE(knows(frames, 3001, kNewest));
  EXPECT_LT(distance(*frames.at("base_link", recordedAt(3000), kNewest), T_map_base(1000)), 1e-9);
}

TEST_F(RecordedFramesTest, areReadUntilTwoSecondsAfterTheBehavior) {
  recordDrive(0, 6000);
  RecordedFrames frames = this->frames(1000);
  EXPECT_TRUE(knows(frames, 2900, kExact));
  EXPECT_FALSE(knows(frames, 3100, kExact));
}

TEST_F(RecordedFramesTest, mayHaveComeTwoSecondsLate) {
  for (const int ms : {0, 100}) recordBase(ms, 1900);
  for (const int ms : {5000, 5100}) recordBase(ms, 2300);
  RecordedFrames frames = this->frames(10'000);
  EXPECT_TRUE(knows(frames, 50, kExact));
  EXPECT_FALSE(knows(frames, 5050, kExact)) << "that did not help then";
}

TEST_F(RecordedFramesTest, areFoundWhereverItIsAskedFor) {
  recordDrive(0, 120'000);
  RecordedFrames frames = this->frames(120'000);
  for (const int ms : {100'000, 68'000, 99'000, 71'000, 119'000, 10, 31'000, 62'000}) {
    EXPECT_TRUE(knows(frames, ms, kExact)) << ms;
  }
  EXPECT_FALSE(frames.at("", recordedAt(100), kNewest));
  EXPECT_FALSE(frames.at("elsewhere", recordedAt(100), kNewest));
}

}  // namespace
}  // namespace afterglow::nodes::world_anchor_test
