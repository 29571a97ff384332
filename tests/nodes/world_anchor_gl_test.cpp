// Light that was recorded on a robot which has moved since: world-anchored, it lands where it was.
#include <gtest/gtest.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/LaserScan.h>
#include <visualization_msgs/Marker.h>

#include <opencv2/imgproc.hpp>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/typed_message.hpp"
#include "nodes/player/world_anchor.hpp"
#include "nodes/projector/projector_scene.hpp"
#include "nodes/projector/transform_listener.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/player_world.hpp"
#include "tests/support/referee.hpp"
#include "tests/support/ros_bytes.hpp"

namespace afterglow::nodes::world_anchor_gl_test {
namespace {

using test::rosBytes;
using test::rosChannel;
using replay::Stamp;
using test::kBegin;
using test::kMs;
using visualization_msgs::Marker;
constexpr double kDegree = 3.14159265358979 / 180;

ros::Time toTime(Stamp stamp) {
  ros::Time time;
  time.fromNSec(static_cast<std::uint64_t>(stamp.ns));
  return time;
}

Eigen::Isometry3d planar(double x, double y, double degrees, double z = 0) {
  Eigen::Isometry3d T(Eigen::AngleAxisd(degrees * kDegree, Eigen::Vector3d::UnitZ()));
  T.translation() = Eigen::Vector3d(x, y, z);
  return T;
}

geometry_msgs::TransformStamped stamped(const std::string& parent, const std::string& child,
                                        const Eigen::Isometry3d& T, ros::Time stamp) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = parent;
  transform.header.stamp = stamp;
  transform.child_frame_id = child;
  transform.transform = toTransform(T);
  return transform;
}

/// A drive was recorded, with a laser and markers on the robot; it is replayed today.
struct WorldAnchorTest : test::PlayerWorld {
  static Stamp recordedAt(double ms) { return {kBegin + static_cast<std::int64_t>(ms * kMs)}; }

  /// Then: 1 m/s along a bent way.
  static Eigen::Isometry3d T_map_base(double ms) {
    return planar(1 + ms * 1e-3, 2 - ms * 2e-4, 30 + ms * 0.02);
  }

  void recordDrive(int from_ms = 0, int to_ms = 3000, const std::string& top = "map") {
    tf2_msgs::TFMessage fixed;
    fixed.transforms = {stamped("base_link", "laser", planar(0.2, 0, 5, 0.3), ros::Time(1))};
    record(rosChannel<tf2_msgs::TFMessage>("/tf_static"), from_ms, rosBytes(fixed));
    for (int ms = from_ms; ms <= to_ms; ms += 20) {
      tf2_msgs::TFMessage moving;
      moving.transforms = {
          stamped(top, "odom", planar(0.5, 0, 10), toTime(recordedAt(ms))),
          stamped("odom", "base_link", planar(0.5, 0, 10).inverse() * T_map_base(ms),
                  toTime(recordedAt(ms)))};
      record(rosChannel<tf2_msgs::TFMessage>("/tf"), ms, rosBytes(moving));
    }
    topics.clear();  // tf is the recording's, not the behavior's
  }

  static Marker disk(const std::string& frame, double x, double y, Stamp stamp) {
    Marker marker;
    marker.header.frame_id = frame;
    if (stamp.ns != 0) marker.header.stamp = toTime(stamp);
    marker.type = Marker::CYLINDER;
    marker.pose.position.x = x;
    marker.pose.position.y = y;
    marker.pose.orientation.w = 1;
    marker.scale.x = marker.scale.y = 0.06;
    marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1;
    return marker;
  }
  void recordMarker(int ms, const Marker& marker) {
    record(rosChannel<Marker>("/marker"), ms, rosBytes(marker));
  }

  /// Plays; what is said of today's frames goes into `today`.
  test::PlayReport playAnchored(int length_ms, const replay::AnchorSettings& settings = {}) {
    options.clear_projection = false;
    return play(length_ms, "", [&] {
      is_needed = WorldAnchor::refuseUnplaced(*store, plan, settings);
      anchor = std::make_unique<WorldAnchor>(
          *store, plan, settings, [this](const tf2_msgs::TFMessage& transforms) {
            for (const auto& transform : transforms.transforms) {
              EXPECT_TRUE(storeTransform(today, transform, "player", false, ros::Time()).is_stored);
            }
          });
      options.anchor = anchor.get();
    });
  }

  template <typename MessageType>
  MessageType sent(const std::string& topic, std::size_t index = 0) {
    return *toMessage<MessageType>(sink.on(topic).at(index).bytes);
  }
  /// Where a header's frame is today, by the transforms of the player.
  Eigen::Isometry3d placed(const std_msgs::Header& header) {
    return toIsometry(today.lookupTransform("map", header.frame_id, header.stamp).transform);
  }
  static double distance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
    return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
  }

  tf2::BufferCore today;
  std::unique_ptr<WorldAnchor> anchor;
  bool is_needed = false;
};

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
    const Stamp now{kBegin * 2 + 900'000 * kMs + ms};
    anchor->repeat(recordedAt(ms), now);
    std_msgs::Header header;
    header.frame_id = "recorded/base_link";
    header.stamp = toTime(now);
    EXPECT_LT(distance(placed(header), T_map_base(ms)), 1e-4) << ms;
  }
}

/// With a projector, and a judge of where its light lands.
struct WorldAnchorLightTest : WorldAnchorTest {
  void SetUp() override {
    try {
      context = std::make_unique<render::GlContext>();
      context->makeCurrent();
    } catch (const std::runtime_error& error) {
      if (std::getenv("AFTERGLOW_REQUIRE_GL")) FAIL() << error.what();
      GTEST_SKIP() << error.what();
    }
    const std::string absence = test::refereeAbsence();
    if (!absence.empty()) GTEST_SKIP() << absence;
  }
  std::unique_ptr<render::GlContext> context;
};

TEST_F(WorldAnchorLightTest, landsWhereItWasThoughTheRobotHasMovedByHalfAMeterAndTurned) {
  test::Referee referee("standard", 2);
  // The referee's world is today's map. Its projector is on the robot, in a place of today; then
  // the robot stood 0.5 m from there, turned by 40 degrees.
  const Eigen::Isometry3d T_map_projector = referee.T_world_projector.matrix();
  const Eigen::Isometry3d T_map_base_today = planar(0.3, -0.2, 15);
  const Eigen::Isometry3d T_map_base_then = T_map_base_today * planar(0.3, 0.4, 40);
  // A spot that the projector reaches today, where its ray meets the floor.
  const Eigen::Vector3d eye = T_map_projector.translation();
  const Eigen::Vector2d pixel(0.6 * referee.lens.width, 0.6 * referee.lens.height);
  const Eigen::Vector3d way = T_map_projector * *calib::unproject(referee.lens, pixel) - eye;
  const Eigen::Vector3d spot = eye - way * (eye.z() / way.z());
  const Eigen::Vector3d p_base = T_map_base_then.inverse() * spot;

  tf2_msgs::TFMessage then;
  for (const int ms : {0, 1000, 2000}) {
    then.transforms = {stamped("map", "base_link", T_map_base_then, toTime(recordedAt(ms)))};
    record(rosChannel<tf2_msgs::TFMessage>("/tf"), ms, rosBytes(then));
  }
  topics.clear();
  recordMarker(500, disk("base_link", p_base.x(), p_base.y(), recordedAt(480)));
  EXPECT_TRUE(playAnchored(1500).is_complete);

  const auto light = sent<Marker>("/marker");
  const Eigen::Isometry3d T_base_projector = T_map_base_today.inverse() * T_map_projector;
  today.setTransform(stamped("map", "base_link", T_map_base_today, light.header.stamp), "robot");
  today.setTransform(stamped("base_link", "projector", T_base_projector, ros::Time(1)), "robot",
                     true);
  ProjectorConfig config;
  config.fixed_frame = "map";
  config.projectors.resize(1);
  config.projectors[0].frame = "projector";
  config.layers.resize(1);
  config.layers[0].topic = "/marker";
  config.layers[0].type = LayerType::Marker;
  ProjectorScene scene(config, today);
  scene.add(0, light, light.header.stamp);
  const SceneSnapshot snapshot = scene.snapshot(light.header.stamp);
  ASSERT_TRUE(snapshot.T_projector_world);
  ASSERT_EQ(snapshot.scene.layers.at(0).drawables.size(), 1u);

  const render::Image image = render::ProjectorRenderer(*context, referee.lens)
                                  .render(snapshot.scene, *snapshot.T_projector_world);
  test::RefereeSurface floor{"floor", Eigen::Isometry3d::Identity(), 0.4, 0.4};
  floor.T_world_surface.translation() = spot;
  const cv::Mat top = referee.topView(image, {floor}, "floor");
  const cv::Moments moments = cv::moments(top);
  const double step = test::Referee::kStep;
  const Eigen::Vector2d off((moments.m10 / moments.m00 - (top.cols - 1) / 2.0) * step,
                            -(moments.m01 / moments.m00 - (top.rows - 1) / 2.0) * step);
  std::printf("world-anchored light is off by %.2f mm; %.0f mm2 are lit\n", 1e3 * off.norm(),
              1e6 * moments.m00 * step * step);
  EXPECT_LT(off.norm(), 0.002);
  EXPECT_NEAR(moments.m00 * step * step, 3.14159 * 0.03 * 0.03, 0.0003);
}

}  // namespace
}  // namespace afterglow::nodes::world_anchor_gl_test
