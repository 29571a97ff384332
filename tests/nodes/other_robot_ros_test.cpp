// A base that cannot follow its recorded poses is refused: another robot's frames, no localization,
// dead odometry, another map. The command in processes of its own, and this process as the robot.
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <nav_msgs/OccupancyGrid.h>
#include <tf2_msgs/TFMessage.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/recorder/world_snapshot.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_bytes.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::other_robot_ros_test {
namespace {

using test::rosBytes;

constexpr std::int64_t kMs = 1'000'000;

geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child,
                                          double x, ros::Time stamp) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = parent;
  transform.header.stamp = stamp;
  transform.child_frame_id = child;
  transform.transform.translation.x = x;
  transform.transform.rotation.w = 1;
  return transform;
}

tf2_msgs::TFMessage together(std::vector<geometry_msgs::TransformStamped> transforms) {
  tf2_msgs::TFMessage message;
  message.transforms = std::move(transforms);
  return message;
}

nav_msgs::OccupancyGrid mapOf(std::int8_t cell) {
  nav_msgs::OccupancyGrid map;
  map.info.width = map.info.height = 1;
  map.data = {cell};
  return map;
}

/// Drives of a second, 0.2 m, as robots with such frames would have recorded them.
class Drives {
 public:
  explicit Drives(const std::string& path)
      : store_(replay::openStore(path, replay::OpenMode::ReadWrite)),
        recording_(store_->addRecording({0, "", "test", ""})) {}

  std::string add(const std::string& odometry, const std::string& base, bool is_localized,
                  const std::string& map = "") {
    for (int i = 0; i <= 50; ++i) {
      const std::int64_t at = begin_ + i * 20 * kMs;
      ros::Time stamp;
      stamp.fromNSec(static_cast<std::uint64_t>(at));
      std::vector<geometry_msgs::TransformStamped> poses = {
          transform(odometry, base, i * 0.004, stamp)};
      if (is_localized) poses.push_back(transform("map", odometry, 0, stamp));
      append("/tf", at, together(poses));
      geometry_msgs::Twist twist;
      twist.linear.x = 0.2;
      if (i < 50) append("/cmd_vel", at + kMs, twist);
    }
    replay::Behavior behavior;
    behavior.recording = recording_;
    behavior.name = "drive";
    behavior.begin = {begin_};
    behavior.end = replay::Stamp{begin_ + 1000 * kMs};
    behavior.topics = {"/cmd_vel"};
    replay::Snapshot snapshot;
    snapshot.map = map;
    behavior.snapshot = snapshot.toJson();
    begin_ += 100'000 * kMs;
    return std::to_string(store_->addBehavior(behavior));
  }

 private:
  template <typename Ros>
  void append(const std::string& topic, std::int64_t at, const Ros& message) {
    namespace traits = ros::message_traits;
    const std::int64_t channel = store_->addChannel(
        recording_, {topic, traits::DataType<Ros>::value(), traits::MD5Sum<Ros>::value(),
                     traits::Definition<Ros>::value(), false, "/recorded"});
    store_->append({{channel, {at}, sequence_++, {}, rosBytes(message)}});
  }

  std::unique_ptr<replay::Store> store_;
  std::int64_t recording_, begin_ = 1'600'000'000'000'000'000;
  std::uint64_t sequence_ = 0;
};

class OtherRobot : public testing::Test {
 protected:
  OtherRobot() { spinner_.start(); }
  ~OtherRobot() override {
    spinner_.stop();
    ros::shutdown();
  }

  std::unique_ptr<test::NodeProcess> play(const std::string& behavior,
                                          std::vector<std::string> options = {}) const {
    std::vector<std::string> command = {AFTERGLOW_TEST_COMMAND, "play", behavior, "--store", store,
                                        "--allow-motion", "--no-keys"};
    command.insert(command.end(), options.begin(), options.end());
    return std::make_unique<test::NodeProcess>(command);
  }
  /// It ends with this refusal, and nothing has moved.
  void expectRefused(test::NodeProcess& replay, const std::string& text) {
    EXPECT_EQ(replay.exitStatus(), 1);
    EXPECT_NE(replay.log().find(text), std::string::npos) << replay.log();
    EXPECT_FALSE(has_moved) << text;
  }

  test::TestGraph graph;
  test::TempFolder folder;
  std::string store = folder.path("drives.db");
  ros::NodeHandle node;
  std::atomic<bool> has_moved{false};
  ros::Subscriber base = node.subscribe<geometry_msgs::Twist>(
      "/cmd_vel", 100, [this](const geometry_msgs::TwistConstPtr& twist) {
        if (twist->linear.x != 0) has_moved = true;
      });

 private:
  ros::AsyncSpinner spinner_{2};
};

TEST_F(OtherRobot, isRefusedWhereItsBaseCouldNotFollowItsPosesAndDrivesOnlyIfThatIsAsked) {
  std::optional<Drives> drives(store);
  const std::string turtlebot = drives->add("odom", "base_footprint", true),
                    pr2 = drives->add("odom_combined", "base_footprint", true),
                    unlocalized = drives->add("odom", "base_link", false),
                    stale = drives->add("wheels", "chassis", true),
                    lost = drives->add("odom", "base_link", true),
                    on_map = drives->add("odom", "base_link", true, mapIdentity(mapOf(0)));
  drives.reset();
  ros::Publisher tf = node.advertise<tf2_msgs::TFMessage>("/tf", 10);
  const ros::Time once = ros::Time::now();
  // Of its own copy: a timer's end does not wait for its callback.
  const ros::WallTimer odometry = node.createWallTimer(ros::WallDuration(0.02), [=](const auto&) {
    tf.publish(together({transform("odom", "base_link", 0, ros::Time::now()),
                         transform("wheels", "chassis", 0, once)}));  // again and again the same
  });
  ros::Publisher map = node.advertise<nav_msgs::OccupancyGrid>("/map", 1, true);
  map.publish(mapOf(100));
  {
    const auto a = play(turtlebot), b = play(pr2), c = play(unlocalized), d = play(lost),
               e = play(stale, {"--base-frame", "odom=wheels", "base=chassis"}), f = play(on_map);
    expectRefused(*a, "there are odom -> base_footprint; perhaps --base-frame odom=odom "
                      "base=base_footprint; --open-loop");
    expectRefused(*b, "perhaps --base-frame odom=odom_combined base=base_footprint");
    expectRefused(*c, "it was recorded without localization (map -> odom); --odometry-only");
    expectRefused(*d, "nobody localizes it now (tf's map -> odom); --odometry-only");
    expectRefused(*e, "nobody tells where it is now (tf's wheels -> chassis); --open-loop");
    expectRefused(*f, "the map on /map is not the one it was recorded on");
  }
  const auto asked = play(turtlebot, {"--open-loop", "--no-scan"});
  EXPECT_EQ(asked->exitStatus(), 0) << asked->log();
  EXPECT_TRUE(has_moved);
  EXPECT_NE(asked->log().find("open loop"), std::string::npos) << asked->log();
  has_moved = false;
  const auto alone = play(lost, {"--odometry-only", "--no-scan"});
  (void)alone->exitStatus();
  EXPECT_TRUE(has_moved) << "from where it stands, as nobody localizes it: " << alone->log();
}

}  // namespace
}  // namespace afterglow::nodes::other_robot_ros_test
