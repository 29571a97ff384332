// What a projector's light keeps off: who sees it, where it will be, and what is refused.
#include "nodes/projector/light_avoidance.hpp"

#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <string>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/projector/robot_surface.hpp"
#include "tests/support/cloud_messages.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::light_avoidance_test {
namespace {

ros::Time at(double seconds) { return ros::Time(1000 + seconds); }
std::int64_t ns(ros::Time time) { return static_cast<std::int64_t>(time.toNSec()); }

const std::vector<Eigen::Vector3f> kPerson = {{2, 0, 0.05f}, {2, 0, 1}, {2, 0.1f, 1.5f}};

/// A base with an arm that turns about z, and a head in which the projector sits.
const char kRobot[] = R"(<robot name="small">
  <link name="base"><visual><geometry><box size="0.4 0.4 0.2"/></geometry></visual></link>
  <link name="plate"><visual><geometry><box size="0.1 0.1 0.01"/></geometry></visual></link>
  <joint name="plate" type="fixed"><parent link="base"/><child link="plate"/>
    <origin xyz="0 0 0.3"/></joint>
  <link name="arm"><visual><origin xyz="0.5 0 0"/>
    <geometry><cylinder radius="0.05" length="0.1"/></geometry></visual></link>
  <joint name="arm" type="continuous"><parent link="base"/><child link="arm"/>
    <axis xyz="0 0 1"/></joint>
  <link name="head"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
  <joint name="head" type="continuous"><parent link="base"/><child link="head"/>
    <axis xyz="0 0 1"/></joint>
  <link name="lens"/>
  <joint name="lens" type="fixed"><parent link="head"/><child link="lens"/></joint>
</robot>)";

AvoidConfig config(bool with_cloud, bool with_robot) {
  AvoidConfig config;
  if (with_cloud) {
    config.sources.resize(1);
    config.sources[0].layer.topic = "/cloud";
    config.sources[0].layer.type = LayerType::PointCloud2;
  }
  if (with_robot) config.robot.emplace();
  return config;
}

/// Hand-made transforms and clouds over an endless floor.
class LightAvoidanceTest : public ::testing::Test {
 protected:
  void transform(const std::string& parent, const std::string& child, ros::Time stamp,
                 const Eigen::Vector3d& p, double yaw = 0, bool is_static = false) {
    geometry_msgs::TransformStamped message;
    message.header.frame_id = parent;
    message.child_frame_id = child;
    message.header.stamp = stamp;
    Eigen::Isometry3d T(Eigen::Translation3d(p) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
    message.transform = toTransform(T);
    buffer.setTransform(message, "test", is_static);
  }
  void standStill() {
    transform("map", "camera", {}, {0, 0, 0}, 0, true);
    transform("map", "projector", {}, {0, 0, 2}, 0, true);
  }
  static sensor_msgs::PointCloud2 cloud(ros::Time stamp) {
    auto message = test::cloudMessage("camera", kPerson);
    message.header.stamp = stamp;
    return message;
  }
  /// Empty: problem() says why.
  std::optional<std::vector<render::AvoidedPoints>> points(LightAvoidance& avoidance, ros::Time now,
                                                           ros::Time light) {
    avoidance.update(now, surfaces);
    problems.clear();
    return avoidance.points("projector", {}, ns(light), problems);
  }
  std::string problem(LightAvoidance& avoidance, ros::Time now) {
    EXPECT_FALSE(points(avoidance, now, now));
    return problems.size() == 1 ? problems[0] : "not one problem";
  }
  static RobotSurface robot(const replay::RobotNames& names = {}) {
    return RobotSurface(RobotModel::fromXml(kRobot), names);
  }

  tf2::BufferCore buffer;
  std::vector<render::SurfacePatch> surfaces = {{"floor", {}, {}}};
  std::vector<std::string> problems;
  const std::string kWayOut =
      "; nothing is lit, as nobody can tell what it would hit. Without it: take it out of 'avoid'";
};

TEST_F(LightAvoidanceTest, keepsOffWhatStandsAndFartherTheOlderItIs) {
  standStill();
  LightAvoidance avoidance(config(true, false), buffer, "map");
  avoidance.add(0, cloud(at(0)), at(0.05));
  const auto avoided = points(avoidance, at(0.05), at(0.1));
  ASSERT_TRUE(avoided && avoided->size() == 1);
  EXPECT_EQ(avoided->front().points.size(), 2u) << "the foot may be lit";
  EXPECT_NEAR(avoided->front().padding, 0.1 + 1.6 * 0.1, 1e-5);
  EXPECT_NEAR(points(avoidance, at(0.2), at(0.25))->front().padding, 0.1 + 1.6 * 0.25, 1e-5);
  EXPECT_NEAR(points(avoidance, at(0.2), at(-1))->front().padding, 0.1, 1e-5);
}

TEST_F(LightAvoidanceTest, placesACloudWhereItsCameraWasAndWaitsForThat) {
  transform("map", "camera", at(0), {0, 0, 0});
  transform("map", "camera", at(1), {1, 0, 0});
  transform("map", "projector", {}, {0, 0, 2}, 0, true);
  LightAvoidance avoidance(config(true, false), buffer, "map");
  avoidance.add(0, cloud(at(0.9)), at(1));
  avoidance.add(0, cloud(at(1.1)), at(1.2));
  EXPECT_TRUE(avoidance.isWaiting());
  auto avoided = points(avoidance, at(1.2), at(1.2));
  ASSERT_TRUE(avoided);
  EXPECT_NEAR(avoided->front().pose.matrix().translation().x(), 0.9, 1e-6);
  transform("map", "camera", at(1.2), {3, 0, 0});
  avoided = points(avoidance, at(1.3), at(1.3));
  EXPECT_FALSE(avoidance.isWaiting());
  ASSERT_TRUE(avoided);
  EXPECT_NEAR(avoided->front().pose.matrix().translation().x(), 2, 1e-6);
  EXPECT_NEAR(avoided->front().padding, 0.1 + 1.6 * 0.2, 1e-5);
}

TEST_F(LightAvoidanceTest, followsASurfaceThatMoves) {
  standStill();
  LightAvoidance avoidance(config(true, false), buffer, "map");
  avoidance.add(0, cloud(at(0)), at(0));
  EXPECT_EQ(points(avoidance, at(0), at(0))->front().points.size(), 2u);
  surfaces[0].T_world_surface =
      Rigid<World, Surface>(Eigen::Isometry3d(Eigen::Translation3d(0, 0, 1)));
  EXPECT_EQ(points(avoidance, at(0.1), at(0.1))->front().points.size(), 1u);
}

TEST_F(LightAvoidanceTest, makesPeopleOfTheLegsThatAScanSees) {
  standStill();
  transform("map", "laser", {}, {0, 0, 0.3}, 0, true);
  AvoidConfig legs = config(true, false);
  legs.sources[0].layer.type = LayerType::LaserScan;
  legs.sources[0].padding = 0.3;
  legs.sources[0].column = 2;
  LightAvoidance avoidance(legs, buffer, "map");
  sensor_msgs::LaserScan scan;
  scan.header.frame_id = "laser";
  scan.header.stamp = at(0);
  scan.range_max = 10;
  scan.angle_increment = 0.1f;
  scan.ranges = {std::numeric_limits<float>::infinity(), 2};
  avoidance.add(0, scan, at(0));
  const auto avoided = points(avoidance, at(0), at(0));
  ASSERT_TRUE(avoided);
  const auto& column = avoided->front().points;
  ASSERT_EQ(column.size(), 21u);
  EXPECT_NEAR((column[0] - Eigen::Vector3f(2 * std::cos(0.1f), 2 * std::sin(0.1f), 0)).norm(), 0,
              1e-5);
  EXPECT_NEAR(column[20].z(), 2, 1e-5);
}

TEST_F(LightAvoidanceTest, refusesAScanWithMoreRangesThanAnyRangeFinder) {
  standStill();
  AvoidConfig legs = config(true, false);
  legs.sources[0].layer.type = LayerType::LaserScan;
  legs.sources[0].column = 2;
  LightAvoidance avoidance(legs, buffer, "map");
  sensor_msgs::LaserScan scan;
  scan.header.frame_id = "camera";
  scan.header.stamp = at(0);
  scan.range_max = 10;
  scan.ranges.assign(100'001, 1);
  avoidance.add(0, scan, at(0));
  EXPECT_EQ(problem(avoidance, at(0)),
            "projector: avoid: /cloud: it has more ranges than any range finder" + kWayOut);
}

TEST_F(LightAvoidanceTest, lightsNothingUntilItSeesAndSaysWhy) {
  LightAvoidance avoidance(config(true, false), buffer, "map");
  EXPECT_EQ(problem(avoidance, at(0)), "projector: avoid: /cloud: no message yet" + kWayOut);
  avoidance.add(0, cloud(at(0)), at(0));
  EXPECT_EQ(problem(avoidance, at(0.1)),
            "projector: avoid: /cloud: no transform from 'camera' to 'map'" + kWayOut);
  standStill();
  EXPECT_TRUE(points(avoidance, at(0.1), at(0.1)));
  surfaces.clear();
  EXPECT_EQ(
      problem(avoidance, at(0.1)),
      "projector: avoid: no surface is known, and so nothing of what stands on one" + kWayOut);
  surfaces.resize(1);
  EXPECT_TRUE(points(avoidance, at(0.5), at(0.5)));
  EXPECT_EQ(problem(avoidance, at(0.8)),
            "projector: avoid: /cloud is stale: what it saw is 0.8 s old" + kWayOut);
  avoidance.clear();
  avoidance.add(0, cloud(at(0.8)), at(0.8));
  EXPECT_TRUE(points(avoidance, at(0.8), at(0.8)));
}

TEST_F(LightAvoidanceTest, refusesCloudsThatTellNothing) {
  standStill();
  LightAvoidance avoidance(config(true, false), buffer, "map");
  const auto reason = [&](const sensor_msgs::PointCloud2& message) {
    avoidance.add(0, message, at(10));
    const std::string text = problem(avoidance, at(10));
    const std::string head = "projector: avoid: /cloud: ";
    return text.substr(head.size(), text.size() - head.size() - kWayOut.size());
  };
  auto message = cloud(at(10));
  message.data.pop_back();
  EXPECT_EQ(reason(message), "data is shorter than declared");
  EXPECT_EQ(reason(cloud({})), "without a stamp, nobody can tell how old it is");
  EXPECT_EQ(reason(cloud(at(11))),
            "stamped ahead of its arrival: set its sender's clock (chrony, ntp)");
  const float kNan = std::numeric_limits<float>::quiet_NaN();
  message = test::cloudMessage("camera", {{kNan, 0, 0}});
  message.header.stamp = at(10);
  EXPECT_EQ(reason(message), "it sees nothing at all");
  message = cloud(at(10));
  message.header.frame_id = "";
  EXPECT_NE(reason(message).find("frame"), std::string::npos);
  EXPECT_EQ(avoidance.status()[0].received, 5u);
  EXPECT_EQ(avoidance.status()[0].dropped.size(), 5u);
}

TEST_F(LightAvoidanceTest, keepsOffLinksWhereTheyWillBe) {
  transform("map", "projector", {}, {0, 0, 2}, 0, true);
  // The arm turns by a radian a second.
  for (const double t : {0.0, 0.05, 0.1}) {
    transform("map", "base", at(t), {1, 0, 0});
    transform("base", "head", at(t), {0, 0, 1});
    transform("base", "arm", at(t), {0, 0, 0}, t);
  }
  LightAvoidance avoidance(config(false, true), buffer, "map");
  EXPECT_TRUE(avoidance.needsRobot());
  EXPECT_EQ(problem(avoidance, at(0.1)),
            "projector: avoid: the robot's description has not been read yet" + kWayOut);
  avoidance.refuseRobot("no robot's description on parameter robot_description");
  EXPECT_EQ(problem(avoidance, at(0.1)),
            "projector: avoid: no robot's description on parameter robot_description" + kWayOut);
  avoidance.setRobot(robot());
  EXPECT_FALSE(avoidance.needsRobot());
  const auto avoided = points(avoidance, at(0.12), at(0.2));
  ASSERT_TRUE(avoided) << problems.at(0);
  ASSERT_EQ(avoided->size(), 3u) << "arm, base with its plate, head";
  const Eigen::Isometry3d T_lens_arm = avoided->front().pose.matrix();
  EXPECT_NEAR(Eigen::AngleAxisd(T_lens_arm.linear()).angle(), 0.2, 1e-3);
  EXPECT_NEAR((T_lens_arm.translation() - Eigen::Vector3d(1, 0, -2)).norm(), 0, 1e-3);
  EXPECT_FLOAT_EQ(avoided->front().padding, 0.05f);
}

TEST_F(LightAvoidanceTest, takesWhatACloudShowsOfTheRobotForTheRobot) {
  transform("map", "camera", {}, {0, 0, 0}, 0, true);
  transform("map", "projector", {}, {0, 0, 2}, 0, true);
  for (const double t : {0.0, 0.1}) {
    transform("map", "base", at(t), {2, 0, 0.5});
    transform("base", "head", at(t), {0, 0, 1});
    transform("base", "arm", at(t), {0, 0, 0}, 10 * t);
  }
  LightAvoidance avoidance(config(true, true), buffer, "map");
  avoidance.setRobot(robot());
  // On the arm where it was, on it where it is now, beside it.
  const float turn = 0.5f;
  auto message =
      test::cloudMessage("camera", {{2 + 0.5f * std::cos(turn), 0.5f * std::sin(turn), 0.555f},
                                    {2 + 0.5f * std::cos(1.f), 0.5f * std::sin(1.f), 0.555f},
                                    {2 + 0.5f * std::cos(turn), 0.5f * std::sin(turn), 0.65f}});
  message.header.stamp = at(0.05);
  avoidance.add(0, message, at(0.1));
  const auto avoided = points(avoidance, at(0.1), at(0.1));
  ASSERT_TRUE(avoided) << problems.at(0);
  EXPECT_EQ(avoided->front().points.size(), 2u);
}

TEST_F(LightAvoidanceTest, keepsNothingOffTheProjectorsOwnHousing) {
  for (const double t : {0.0, 0.1}) {
    transform("map", "base", at(t), {1, 0, 0});
    transform("base", "head", at(t), {0, 0, 1});
    transform("base", "arm", at(t), {0, 0, 0});
  }
  transform("head", "lens", {}, {0, 0, 0}, 0, true);
  transform("lens", "projector", {}, {0, 0, 0.01}, 0, true);
  LightAvoidance avoidance(config(false, true), buffer, "map");
  avoidance.setRobot(robot());
  const auto avoided = points(avoidance, at(0.1), at(0.1));
  ASSERT_TRUE(avoided) << problems.at(0);
  EXPECT_EQ(avoided->size(), 2u) << "arm, base";
}

TEST_F(LightAvoidanceTest, lightsNothingWhereALinkIsLost) {
  transform("map", "projector", {}, {0, 0, 2}, 0, true);
  transform("map", "base", at(0), {1, 0, 0});
  LightAvoidance avoidance(config(false, true), buffer, "map");
  avoidance.setRobot(robot());
  EXPECT_EQ(problem(avoidance, at(0)),
            "projector: avoid: the robot: no transform from 'arm' to 'projector'" + kWayOut);
  transform("base", "arm", at(0), {0, 0, 0});
  transform("base", "head", at(0), {0, 0, 0});
  EXPECT_TRUE(points(avoidance, at(0.4), at(0.4)));
  EXPECT_EQ(
      problem(avoidance, at(0.7)),
      "projector: avoid: the transform from 'arm' to 'projector' is stale: 0.7 s old" + kWayOut);
}

TEST_F(LightAvoidanceTest, refusesARobotThatIsNotInMeters) {
  std::string large = kRobot;
  large.replace(large.find("0.4 0.4 0.2"), 11, "400 400 200");
  try {
    RobotSurface(RobotModel::fromXml(large), {});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(),
                 "link base: a shape that is not finite, or too large: not in meters?");
  }
}

TEST_F(LightAvoidanceTest, namesTheLinksOfOneOfSeveralRobots) {
  const RobotSurface surface = robot({"/robot1", "robot1"});
  ASSERT_EQ(surface.parts().size(), 3u);
  EXPECT_EQ(surface.parts()[0].frame, "robot1/arm");
  EXPECT_EQ(surface.parts()[1].links, (std::set<std::string>{"robot1/base", "robot1/plate"}));
  float highest = 0;
  for (const Eigen::Vector3f& p : surface.parts()[1].points) highest = std::max(highest, p.z());
  EXPECT_FLOAT_EQ(highest, 0.305f) << "the plate, in the base's frame";
}

// ----------------------------------------------------------------------------------- configuration

class AvoidConfigTest : public ::testing::Test {
 protected:
  AvoidConfig load(const std::string& avoid, const std::string& surfaces = kFloor) {
    const std::string path = folder_.path("c.yaml");
    std::ofstream(path) << "fixed_frame: map\nprojector: {camera_info: p.yaml, frame: optical}\n"
                        << "layers: [{topic: /m, type: visualization_msgs/Marker}]\n"
                        << surfaces << "avoid:\n"
                        << avoid;
    return *loadProjectorConfig(path, "").avoid;
  }
  std::string fault(const std::string& avoid, const std::string& surfaces = kFloor) {
    try {
      load(avoid, surfaces);
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr(folder_.path("").size());
    }
    return "no fault";
  }

  static inline const std::string kFloor = "surfaces: {floor: {frame: map}}\n";
  const std::string kCloud = "  from: [{topic: /c, type: sensor_msgs/PointCloud2}]\n";
  test::TempFolder folder_;
};

TEST_F(AvoidConfigTest, hasDefaultsForPeopleAndArms) {
  AvoidConfig config = load(
      "  from:\n  - {topic: /c, type: sensor_msgs/PointCloud2}\n"
      "  - {topic: /s, type: sensor_msgs/LaserScan}\n  robot: {}\n");
  ASSERT_EQ(config.sources.size(), 2u);
  EXPECT_EQ(config.sources[0].padding, 0.1);
  EXPECT_EQ(config.sources[0].column, 0);
  EXPECT_EQ(config.sources[1].layer.type, LayerType::LaserScan);
  EXPECT_EQ(config.sources[1].padding, 0.3);
  EXPECT_EQ(config.sources[1].column, 2);
  ASSERT_TRUE(config.robot);
  EXPECT_EQ(config.robot->description, "robot_description");
  EXPECT_EQ(config.height, 0.1);
  EXPECT_EQ(config.speed, 1.6);
  EXPECT_EQ(config.patience_ns, 500'000'000);
  config = load(kCloud + "  height: 0.2\n  speed: 0\n  patience_s: 1\n", kFloor);
  EXPECT_FALSE(config.robot);
  EXPECT_EQ(config.height, 0.2);
  EXPECT_EQ(config.speed, 0);
  EXPECT_EQ(config.patience_ns, 1'000'000'000);
}

TEST_F(AvoidConfigTest, refusesWhatCannotBeMeant) {
  EXPECT_EQ(fault("  height: 0.1\n"),
            "c.yaml:6: 'avoid' needs 'from', clouds and scans that see people, or 'robot'");
  EXPECT_EQ(fault(kCloud, ""),
            "c.yaml:5: 'from' of 'avoid' needs 'surfaces': what stands on them is avoided");
  EXPECT_EQ(fault("  from: []\n"),
            "c.yaml:6: 'from' of 'avoid' should be a list of at least one cloud or scan");
  EXPECT_EQ(fault("  from: [{topic: c, type: sensor_msgs/PointCloud2}]\n"),
            "c.yaml:6: topic 'c' should begin with '/'");
  EXPECT_NE(fault("  from: [{topic: /c, type: nav_msgs/Path}]\n").find("sensor_msgs/LaserScan"),
            std::string::npos);
  EXPECT_EQ(fault("  from: [{topic: /c, type: sensor_msgs/PointCloud2, column: 2}]\n"),
            "c.yaml:6: 'column' in source 1 of 'avoid' has no meaning without a scan");
  EXPECT_EQ(fault("  robot: {description: /robot_description}\n"),
            "c.yaml:6: 'description' of 'robot' of 'avoid' is looked for in the node's namespace "
            "and above it: write it without '/'");
  EXPECT_EQ(fault("  robot: {}\n  speed: 1\n"),
            "c.yaml:7: 'speed' of 'avoid' has no meaning without 'from'");
  EXPECT_NE(fault(kCloud + "  height: 3\n").find("c.yaml:7: "), std::string::npos);
  EXPECT_NE(fault(kCloud + "  speed: -1\n").find("c.yaml:7: "), std::string::npos);
  EXPECT_NE(fault(kCloud + "  patience_s: .nan\n").find("c.yaml:7: "), std::string::npos);
  EXPECT_NE(fault(kCloud + "  pading: 1\n").find("c.yaml:7: "), std::string::npos);
  EXPECT_EQ(fault("  from:\n  - {topic: /c, type: sensor_msgs/PointCloud2}\n"
                  "  - {topic: /c, type: sensor_msgs/PointCloud2}\n"),
            "c.yaml:8: topic '/c' twice");
}

}  // namespace
}  // namespace afterglow::nodes::light_avoidance_test
