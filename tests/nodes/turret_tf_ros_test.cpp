// A turret calibrated as a user does it, and where its projector then is in tf.
#include <tf2_msgs/TFMessage.h>

#include <filesystem>
#include <mutex>
#include <optional>

#include "nodes/conversion/geometry_conversion.hpp"
#include "tests/support/calibrate_command.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/true_turret.hpp"

namespace afterglow::nodes::turret_tf_ros_test {
namespace {

/// A robot whose tf says how the turret stands by its description; the camera beside its base.
class Robot {
 public:
  Robot() {
    T_base_camera_.translation() = Eigen::Vector3d(0.1, 0.2, 0.3);
    fixed_.publish(message("turret_base", "camera_optical_frame", T_base_camera_));
    seen_ = nh_.subscribe<tf2_msgs::TFMessage>(
        "/tf", 100, [this](const tf2_msgs::TFMessage::ConstPtr& tf) { take(*tf); });
    spinner_.start();
  }

  void turn(double pan, double tilt) {
    const auto tf = test::TrueTurret::tf(pan, tilt);
    tf2_msgs::TFMessage both = message("turret_base", "pan_link", tf[0]);
    both.transforms.push_back(message("pan_link", "tilt_link", tf[1]).transforms[0]);
    both.transforms[1].header.stamp = both.transforms[0].header.stamp;
    moving_.publish(both);
    const std::lock_guard<std::mutex> lock(mutex_);
    turned_ = both.transforms[0].header.stamp;
  }

  /// Itself and the node: what is sent before is heard by nobody again.
  bool isConnected() const {
    return seen_.getNumPublishers() == 2 && moving_.getNumSubscribers() == 2;
  }

  /// Where the projector is, as of the last turn.
  std::optional<Eigen::Isometry3d> projector() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!sent_ || sent_->header.stamp != turned_) return std::nullopt;
    EXPECT_EQ(sent_->header.frame_id, "turret_base");
    return toIsometry(sent_->transform);
  }

  const Eigen::Isometry3d& T_base_camera() const { return T_base_camera_; }

 private:
  static tf2_msgs::TFMessage message(const std::string& parent, const std::string& child,
                                     const Eigen::Isometry3d& T) {
    tf2_msgs::TFMessage message;
    message.transforms.resize(1);
    message.transforms[0].header.stamp = ros::Time::now();
    message.transforms[0].header.frame_id = parent;
    message.transforms[0].child_frame_id = child;
    message.transforms[0].transform = toTransform(T);
    return message;
  }

  void take(const tf2_msgs::TFMessage& tf) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& transform : tf.transforms) {
      if (transform.child_frame_id == "lamp") sent_ = transform;
    }
  }

  ros::NodeHandle nh_;
  ros::Publisher fixed_ = nh_.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
  ros::Publisher moving_ = nh_.advertise<tf2_msgs::TFMessage>("/tf", 1, true);
  ros::Subscriber seen_;
  Eigen::Isometry3d T_base_camera_ = Eigen::Isometry3d::Identity();
  std::mutex mutex_;
  ros::Time turned_;
  std::optional<geometry_msgs::TransformStamped> sent_;
  ros::AsyncSpinner spinner_{1};
};

class TurretCommand : public test::CalibrateCommand {
 protected:
  ProgramResult addPose(const std::string& name, const Eigen::Isometry3d& T_camera_projector) {
    std::ostringstream rows;
    for (int row = 0; row < 4; ++row) {
      rows << "  - [";
      for (int column = 0; column < 4; ++column) {
        rows << (column == 0 ? "" : ", ") << T_camera_projector.matrix()(row, column);
      }
      rows << "]\n";
    }
    write(name + "/T_camera_projector.yaml",
          "parent_frame: camera_optical_frame\nchild_frame: projector_optical_frame\n"
          "T_camera_projector:\n" + rows.str());
    return calibrate({"mount", "--calibration", path(name), "--turret",
                      "turret_base,pan_link,tilt_link", "--add-to", path("poses.yaml"),
                      "--projector-frame", "lamp", "--out", path("out")});
  }
  bool isThere(const std::string& name) const { return std::filesystem::exists(path(name)); }
};

TEST_F(TurretCommand, putsTheProjectorWhereItIsAtAnyAngle) {
  const test::RosMaster master;
  int argc = 0;
  ros::init(argc, nullptr, "turret_test", ros::init_options::NoSigintHandler);
  Robot robot;
  const test::TrueTurret truth(11);
  const std::vector<std::pair<double, double>> angles = {{0, 0}, {60, 35}, {-60, 35}, {40, -40},
                                                         {-40, -40}};
  std::string said;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const auto [pan, tilt] = angles[i];
    robot.turn(pan, tilt);
    const ProgramResult result =
        addPose("pose" + std::to_string(i),
                robot.T_base_camera().inverse() * truth.T_base_projector(pan, tilt));
    ASSERT_EQ(result.status, 0) << result.output;
    EXPECT_EQ(isThere("out/static_transform.yaml"), i < 2) << i;
    EXPECT_EQ(isThere("out/turret.yaml"), i >= 2) << i;
    if (i == 0) {
      EXPECT_NE(result.output.find("1 of 3 poses that are needed (five are good); turn 'pan_link', "
                                   "too: it turned by 0.0 deg"),
                std::string::npos)
          << result.output;
    }
    said = result.output;
  }
  EXPECT_NE(said.find("pan_link      120 deg"), std::string::npos) << said;
  EXPECT_NE(said.find("light at 1.5 m will be off by at most"), std::string::npos) << said;
  EXPECT_EQ(calibrate({"mount", "--poses", path("poses.yaml"), "--out", path("again")}).status, 0);
  EXPECT_TRUE(isThere("again/turret.yaml"));

  test::NodeProcess node({AFTERGLOW_TEST_TURRET_TF_NODE, path("out/turret.yaml")});
  ASSERT_TRUE(test::eventually([&] { return robot.isConnected(); })) << node.log();
  for (const auto& [pan, tilt] : {std::pair(-80.0, 20.0), {75.0, -50.0}}) {
    robot.turn(pan, tilt);
    std::optional<Eigen::Isometry3d> T_base_projector;
    ASSERT_TRUE(test::eventually([&] {
      T_base_projector = robot.projector();
      return T_base_projector.has_value();
    })) << node.log();
    for (const double mm : truth.lightOff_mm(pan, tilt, *T_base_projector)) EXPECT_LT(mm, 1);
  }
  node.interrupt();
  EXPECT_EQ(node.exitStatus(), 0);
  const ProgramResult wrong = runProgram({AFTERGLOW_TEST_TURRET_TF_NODE, path("poses.yaml")});
  EXPECT_EQ(wrong.status, 1);
  EXPECT_NE(wrong.output.find("poses.yaml:2: unknown key 'poses'"), std::string::npos)
      << wrong.output;
}

}  // namespace
}  // namespace afterglow::nodes::turret_tf_ros_test
