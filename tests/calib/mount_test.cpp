#include "calib/mount/mount.hpp"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <random>
#include <sstream>

#include "tests/support/optics.hpp"

namespace afterglow::calib::mount_test {
namespace {

/// A turret that carries a projector past a camera that stands still, tf and calibration with
/// errors of a millimeter and some hundredths of a degree.
class Turret {
 public:
  explicit Turret(unsigned seed) : random_(seed) {
    truth_.linear() = test::randomRotation(random_);
    truth_.translation() = Eigen::Vector3d(0.08, -0.02, 0.11);
  }

  const Eigen::Isometry3d& truth() const { return truth_; }

  std::vector<MountPose> poses(int count, double noise_mm = 0.7, double noise_deg = 0.03) {
    std::vector<MountPose> poses;
    for (int i = 0; i < count; ++i) {
      // Where the camera is from the link at this pose, and what the calibration then says.
      Eigen::Isometry3d T_link_camera = Eigen::Isometry3d::Identity();
      T_link_camera.linear() = test::randomRotation(random_);
      T_link_camera.translation() = Eigen::Vector3d(0.3, 0.1 * i, -0.2);
      const Rigid<Camera, Projector> T_camera_projector(T_link_camera.inverse() * truth_ *
                                                        error(noise_mm, noise_deg));
      poses.push_back({"pose " + std::to_string(i + 1),
                       Rigid<Link, Camera>(T_link_camera) * T_camera_projector});
    }
    return poses;
  }

  Eigen::Isometry3d error(double mm, double deg) {
    std::normal_distribution<double> normal;
    const auto vector = [&] {
      return Eigen::Vector3d(normal(random_), normal(random_), normal(random_));
    };
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = mm / 1000 * vector();
    const Eigen::Vector3d turn = deg * M_PI / 180 * vector();
    if (turn.norm() > 0) T.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).matrix();
    return T;
  }

 private:
  std::mt19937 random_;
  Eigen::Isometry3d truth_ = Eigen::Isometry3d::Identity();
};

void shift(MountPose& pose, double mm) {
  Eigen::Isometry3d T = pose.T_link_projector.matrix();
  T.translation().x() += mm / 1000;
  pose.T_link_projector = Rigid<Link, Projector>(T);
}

double offBy_mm(const Mount& mount, const Turret& turret) {
  return 1000 *
         (mount.T_link_projector.matrix().translation() - turret.truth().translation()).norm();
}

std::vector<std::string> leftOut(const Mount& mount) {
  std::vector<std::string> names;
  for (const MountDeviation& pose : mount.poses) {
    if (!pose.is_used) names.push_back(pose.name);
  }
  return names;
}

std::string refusal(const std::vector<MountPose>& poses) {
  try {
    averageMount(poses);
  } catch (const MountRefused& refused) {
    return refused.what();
  }
  return "accepted";
}

TEST(MeanRotation, isBlindToTheSignOfAQuaternion) {
  std::mt19937 random(3);
  const Eigen::Quaterniond q(test::randomRotation(random));
  const Eigen::Quaterniond minus(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT(meanRotation({q, minus, q, minus}).angularDistance(q), 1e-7);
  const Eigen::Quaterniond a(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()));
  Eigen::Quaterniond b(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ()));
  b.coeffs() *= -1;
  const Eigen::Quaterniond middle(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()));
  EXPECT_LT(meanRotation({a, b}).angularDistance(middle), 1e-7);
  EXPECT_THROW(meanRotation({}), std::invalid_argument);
}

TEST(Mount, onePoseIsTakenAsItIsAndHasNoSpread) {
  Turret turret(1);
  const Mount mount = averageMount(turret.poses(1, 0, 0));
  EXPECT_TRUE(mount.T_link_projector.matrix().isApprox(turret.truth(), 1e-9));
  EXPECT_FALSE(mount.spread_mm);
  EXPECT_FALSE(mount.spread_deg);
  EXPECT_THROW(averageMount({}), std::invalid_argument);
}

TEST(Mount, theMeanOfManyPosesIsBetterThanOne) {
  double one = 0, many = 0, turned = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    Turret turret(seed);
    const auto poses = turret.poses(9);
    one += offBy_mm(averageMount({poses[0]}), turret);
    const Mount mount = averageMount(poses);
    many += offBy_mm(mount, turret);
    turned += Eigen::Quaterniond(mount.T_link_projector.matrix().linear())
                  .angularDistance(Eigen::Quaterniond(turret.truth().linear()));
    // 0.7 mm an axis are 1.2 mm in space.
    EXPECT_NEAR(*mount.spread_mm, 1.2, 0.6);
    EXPECT_NEAR(*mount.spread_deg, 0.05, 0.03);
  }
  EXPECT_LT(many, 0.45 * one) << "nine poses: a third";
  EXPECT_LT(turned / 30 * 180 / M_PI, 0.03);
}

TEST(Mount, leavesOutTheOnePoseThatTheOthersContradict) {
  Turret turret(5);
  auto poses = turret.poses(5);
  shift(poses[2], 40);
  const Mount mount = averageMount(poses);
  EXPECT_EQ(leftOut(mount), std::vector<std::string>{"pose 3"});
  EXPECT_NEAR(mount.poses[2].mm, 40, 3);
  EXPECT_LT(offBy_mm(mount, turret), 1.5);
  EXPECT_LT(*mount.spread_mm, 2);
}

TEST(Mount, leavesOutATurnedPoseToo) {
  Turret turret(6);
  auto poses = turret.poses(3);
  Eigen::Isometry3d T = poses[0].T_link_projector.matrix();
  T.rotate(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY()));
  poses[0].T_link_projector = Rigid<Link, Projector>(T);
  EXPECT_EQ(leftOut(averageMount(poses)), std::vector<std::string>{"pose 1"});
}

TEST(Mount, leavesOutWhatIsWithinTheLimitsButOutOfTheFamily) {
  Turret turret(7);
  auto poses = turret.poses(6, 0.1, 0.002);
  EXPECT_TRUE(leftOut(averageMount(poses)).empty());
  shift(poses[4], 3);
  EXPECT_EQ(leftOut(averageMount(poses)), std::vector<std::string>{"pose 5"});
}

TEST(Mount, refusesWhatContradictsItselfAndSaysWhoByHowMuch) {
  Turret turret(8);
  auto poses = turret.poses(2, 0, 0);
  poses[1].name = "right";
  shift(poses[1], 24);
  const std::string text = refusal(poses);
  EXPECT_NE(text.find("pose 1 12.0 mm 0.00 deg, right 12.0 mm 0.00 deg"), std::string::npos)
      << text;
  EXPECT_NE(text.find("check that each camera transform"), std::string::npos) << text;
  poses = turret.poses(5, 0, 0);
  shift(poses[0], 30);
  shift(poses[1], -30);
  EXPECT_NE(refusal(poses).find("contradict"), std::string::npos) << "two of five";
}

TEST(MountText, hasTheArgumentsInTheOrderOfStaticTransformPublisher) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(0.1, -0.2, 0.3);
  T.linear() = Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitX()).matrix();
  const Mount mount = averageMount({{"one", Rigid<Link, Projector>(T)}});
  const std::string launch = staticTransformLaunch(mount, {"turret_tilt_link"});
  const auto begin = launch.find("args=\"") + 6;
  std::istringstream arguments(launch.substr(begin, launch.find('"', begin) - begin));
  std::vector<double> numbers(7);
  std::string parent, child;
  for (double& number : numbers) arguments >> number;
  arguments >> parent >> child;
  const double half = std::sqrt(0.5);
  const std::vector<double> expected = {0.1, -0.2, 0.3, -half, 0, 0, half};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(numbers[i], expected[i], 1e-12) << i;
  EXPECT_EQ(parent, "turret_tilt_link");
  EXPECT_EQ(child, "projector_optical_frame");
  EXPECT_THROW(staticTransformLaunch(mount, {"/link"}), std::invalid_argument);
  EXPECT_THROW(staticTransformLaunch(mount, {"a\" b"}), std::invalid_argument);
}

TEST(MountText, yamlReadsBackExactly) {
  Turret turret(9);
  auto poses = turret.poses(4);
  shift(poses[3], 60);
  const Mount mount = averageMount(poses);
  const YAML::Node yaml = YAML::Load(staticTransformYaml(mount, {"link", "projector"}));
  EXPECT_EQ(yaml["parent_frame"].as<std::string>(), "link");
  EXPECT_EQ(yaml["child_frame"].as<std::string>(), "projector");
  const Eigen::Vector3d t(yaml["translation"]["x"].as<double>(),
                          yaml["translation"]["y"].as<double>(),
                          yaml["translation"]["z"].as<double>());
  EXPECT_EQ(t, Eigen::Vector3d(mount.T_link_projector.matrix().translation()));
  const Eigen::Quaterniond q(yaml["rotation"]["w"].as<double>(), yaml["rotation"]["x"].as<double>(),
                             yaml["rotation"]["y"].as<double>(),
                             yaml["rotation"]["z"].as<double>());
  EXPECT_TRUE(q.toRotationMatrix().isApprox(mount.T_link_projector.matrix().linear(), 1e-12));
  EXPECT_NEAR(yaml["spread_mm"].as<double>(), *mount.spread_mm, 1e-3);
  ASSERT_EQ(yaml["poses"].size(), 4u);
  EXPECT_FALSE(yaml["poses"][3]["used"].as<bool>());
  EXPECT_EQ(yaml["poses"][3]["name"].as<std::string>(), "pose 4");
  const Mount one = averageMount({poses[0]});
  EXPECT_TRUE(YAML::Load(staticTransformYaml(one, {"link", "projector"}))["spread_mm"].IsNull());
}

}  // namespace
}  // namespace afterglow::calib::mount_test
