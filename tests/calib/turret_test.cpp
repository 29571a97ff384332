#include "calib/mount/turret.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "calib/mount/turret_fit.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/true_turret.hpp"

namespace afterglow::calib::turret_test {
namespace {

using test::TrueTurret;
using test::TurretFaults;

double share(const std::vector<double>& sorted, double part) {
  return sorted[static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1))];
}

/// The light of five poses' mean, as projectors without a turret have it.
std::vector<double> lightOfMean_mm(const TrueTurret& truth, const std::vector<TurretPose>& poses) {
  std::vector<MountPose> mounts;
  for (const TurretPose& pose : poses) mounts.push_back(pose.mount);
  Turret turret;
  turret.joints.resize(2);
  turret.T_link_projector = averageMount(mounts, {1000, 90}).T_link_projector;
  return truth.lightOff_mm(turret);
}

void shift(TurretPose& pose, double mm) {
  Eigen::Isometry3d T = pose.mount.T_link_projector.matrix();
  T.translation().x() += mm / 1000;
  pose.mount.T_link_projector = Rigid<Link, Projector>(T);
}

std::vector<std::string> leftOut(const TurretFit& fit) {
  std::vector<std::string> names;
  for (const MountDeviation& pose : fit.poses) {
    if (!pose.is_used) names.push_back(pose.name);
  }
  return names;
}

std::string refusal(const std::vector<TurretPose>& poses) {
  try {
    fitTurret(poses, TrueTurret::links());
  } catch (const std::exception& refused) {
    return refused.what();
  }
  return "accepted";
}

TEST(Turret, lightIsRightAtEveryAngleAfterFivePoses) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    TrueTurret truth(seed);
    const auto poses = truth.fivePoses();
    const TurretFit fit = fitTurret(poses, TrueTurret::links());
    const auto off = truth.lightOff_mm(fit.turret);
    EXPECT_LT(share(off, 0.95), 1.5) << seed;
    EXPECT_LT(off.back(), 2) << seed;
    EXPECT_GT(share(lightOfMean_mm(truth, poses), 0.95), 5) << seed << ": the mean of the poses";
    EXPECT_TRUE(leftOut(fit).empty()) << seed;
  }
}

TEST(Turret, saysHowFarOffLightWillBe) {
  for (const double deg : {0.003, 0.03}) {
    int covered = 0;
    double told = 0, is = 0;
    for (unsigned seed = 1; seed <= 25; ++seed) {
      TurretFaults faults;
      faults.pose_deg = deg;
      faults.pose_mm = 10 * deg;
      TrueTurret truth(seed, faults);
      const TurretFit fit = fitTurret(truth.fivePoses(), TrueTurret::links());
      const double off = share(truth.lightOff_mm(fit.turret), 0.95);
      if (off <= fit.light_beyond_mm) ++covered;
      EXPECT_LT(fit.light_mm, fit.light_beyond_mm);
      told += fit.light_beyond_mm;
      is += off;
    }
    EXPECT_GE(covered, 22) << deg;
    EXPECT_LT(told, 8 * is) << deg;
  }
}

TEST(Turret, aCameraThatStandsOtherwiseThanTfSaysIsFollowed) {
  TrueTurret truth(3);
  auto poses = truth.fivePoses();
  Eigen::Isometry3d wrong(Eigen::Translation3d(0.008, -0.005, 0.01));
  wrong.rotate(Eigen::AngleAxisd(0.02, Eigen::Vector3d(1, 2, -1).normalized()));
  for (TurretPose& pose : poses) {
    const Eigen::Isometry3d T = pose.T_base_link();
    pose.mount.T_link_projector = Rigid<Link, Projector>(
        T.inverse() * wrong * T * pose.mount.T_link_projector.matrix());
  }
  const TurretFit fit = fitTurret(poses, TrueTurret::links());
  for (const double pan : {-90, 0, 90}) {
    const auto seen = wrong.inverse() * fit.turret.T_base_projector(TrueTurret::tf(pan, 20));
    for (const double mm : truth.lightOff_mm(pan, 20, seen)) EXPECT_LT(mm, 2) << pan;
  }
}

TEST(Turret, mayHaveOneJointOnly) {
  TrueTurret truth(4);
  std::vector<TurretPose> poses;
  for (const double pan : {-50.0, -10.0, 20.0, 50.0}) {
    TurretPose pose = truth.pose(std::to_string(pan), pan, 10);
    pose.mount.T_link_projector = Rigid<Link, Projector>(
        pose.T_parent_link[1] * pose.mount.T_link_projector.matrix());
    pose.T_parent_link.pop_back();
    poses.push_back(pose);
  }
  const TurretFit fit = fitTurret(poses, {"turret_base", "pan_link"});
  for (const double pan : {-90, 0, 90}) {
    const auto thought = fit.turret.T_base_projector({TrueTurret::tf(pan, 10)[0]});
    for (const double mm : truth.lightOff_mm(pan, 10, thought)) EXPECT_LT(mm, 2) << pan;
  }
}

TEST(Turret, leavesOutTheOnePoseThatTheOthersContradict) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    TrueTurret truth(seed);
    auto poses = truth.fivePoses();
    shift(poses[seed % 5], 8);
    TurretFit fit = fitTurret(poses, TrueTurret::links());
    EXPECT_EQ(leftOut(fit), std::vector<std::string>{poses[seed % 5].mount.name}) << seed;
    EXPECT_LT(share(truth.lightOff_mm(fit.turret), 0.95), 4) << seed;
    // tf of another moment: the turret still turned.
    poses = truth.fivePoses();
    const Eigen::Isometry3d seen =
        poses[1].T_base_link() * poses[1].mount.T_link_projector.matrix();
    poses[1].T_parent_link = TrueTurret::tf(57, 35);
    poses[1].mount.T_link_projector =
        Rigid<Link, Projector>(poses[1].T_base_link().inverse() * seen);
    fit = fitTurret(poses, TrueTurret::links());
    EXPECT_EQ(leftOut(fit), std::vector<std::string>{"low left"}) << seed;
  }
}

TEST(Turret, refusesWhatNoTurretDoes) {
  TrueTurret truth(1);
  auto poses = truth.fivePoses();
  shift(poses[0], 60);
  shift(poses[3], -60);
  const std::string text = refusal(poses);
  EXPECT_EQ(text.find("no turret turns like that"), 0u) << text;
  EXPECT_NE(text.find("middle "), std::string::npos) << text;
}

TEST(Turret, saysWhichAnglesAreMissing) {
  TrueTurret truth(1);
  EXPECT_EQ(refusal({truth.pose("a", 30, 20), truth.pose("b", -30, -20)}),
            "2 of 3 poses that are needed (five are good)");
  EXPECT_EQ(refusal({truth.pose("a", 30, 5), truth.pose("b", -30, 5), truth.pose("c", 0, 5)}),
            "turn 'tilt_link', too: it turned by 0.0 deg, 20 are needed");
  EXPECT_EQ(refusal({truth.pose("a", 9, 25), truth.pose("b", 0, -25), truth.pose("c", -9, 5)}),
            "turn 'pan_link', too: it turned by 18.0 deg, 20 are needed");
  // Only the wrong pose turned.
  auto poses = {truth.pose("a", 30, 0), truth.pose("b", -30, 0), truth.pose("c", 0, 0),
                truth.pose("d", 10, 0), truth.pose("e", 0, 40)};
  std::vector<TurretPose> wrong(poses);
  shift(wrong[4], 200);
  EXPECT_EQ(refusal(wrong),
            "without e, which the other poses contradict: turn 'tilt_link', too: it turned by 0.0 "
            "deg, 20 are needed");
}

TEST(Turret, refusesLinksThatDoMoreThanTurn) {
  TrueTurret truth(1);
  auto poses = truth.fivePoses();
  poses[2].T_parent_link[1].translation().z() += 0.02;
  const std::string expected =
      "'tilt_link' does not turn in 'pan_link' about one axis through its origin (at low right: "
      "20.0 mm";
  EXPECT_EQ(refusal(poses).substr(0, expected.size()), expected);
  poses = truth.fivePoses();
  poses[1].T_parent_link[0].rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  EXPECT_EQ(refusal(poses).find("'pan_link' does not turn in 'turret_base'"), 0u);
  poses = truth.fivePoses();
  poses[1].T_parent_link.pop_back();
  EXPECT_EQ(refusal(poses), "pose low left is not one of this turret: 2 joints, finite numbers");
  poses = truth.fivePoses();
  shift(poses[4], std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(refusal(poses), "pose high right is not one of this turret: 2 joints, finite numbers");
  EXPECT_EQ(refusal({}), "no pose of a turret");
  const Turret turret = fitTurret(truth.fivePoses(), TrueTurret::links()).turret;
  EXPECT_THROW(turret.T_base_projector({}), std::invalid_argument);
}

TEST(TurretFile, readsBackWhatWasWritten) {
  TrueTurret truth(6);
  auto poses = truth.fivePoses();
  poses[0].mount.name = "two\nlines";
  const TurretFit fit = fitTurret(poses, TrueTurret::links());
  const std::string text = turretYaml(fit.turret, turretRemarks(fit));
  EXPECT_NE(text.find("# Pose two lines: "), std::string::npos) << text;
  const test::TempFolder folder;
  test::writeFile(folder.path("turret.yaml"), text);
  const Turret read = loadTurret(folder.path("turret.yaml"));
  EXPECT_EQ(read.projector_frame, "projector_optical_frame");
  EXPECT_EQ(read.joints[1].parent, "pan_link");
  for (const double pan : {-80, 10, 170}) {
    const auto tf = TrueTurret::tf(pan, -0.5 * pan);
    EXPECT_TRUE(read.T_base_projector(tf).isApprox(fit.turret.T_base_projector(tf), 1e-12));
  }
  EXPECT_NE(turretLaunch(read).find("args=\"$(dirname)/turret.yaml\""), std::string::npos);
}

TEST(TurretFile, isRefusedWithItsLine) {
  const test::TempFolder folder;
  const std::string path = folder.path("turret.yaml");
  const std::string whole =
      "projector_frame: p\n"
      "T_link_projector: {translation: [0, 0, 0], rotation: [0, 0, 0, 1]}\n"
      "joints:\n"
      "  - {parent: a, link: b, correction: {translation: [0, 0, 0], rotation: [0, 0, 0, 1]}, "
      "axis: [0, 0, 1], middle: [0, 0, 0, 1], scale: 0}\n";
  const auto refusedFor = [&](const std::string& from, const std::string& to) {
    std::string text = whole;
    test::writeFile(path, text.replace(text.find(from), from.size(), to));
    try {
      loadTurret(path);
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr(path.size());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refusedFor("scale: 0", "scale: 0.0"), "accepted");
  EXPECT_EQ(refusedFor("scale: 0", "scale: 2"), ":4: 'scale' should be -0.5 to 0.5");
  EXPECT_EQ(refusedFor("axis: [0, 0, 1]", "axis: [0, 0, 2]"), ":4: 'axis' should have length 1");
  EXPECT_EQ(refusedFor("frame: p", "frame: /p"),
            ":1: 'projector_frame': '/p' is no tf2 frame name");
  EXPECT_EQ(refusedFor("[0, 0, 0, 1]}\n", "[0, 0, .nan, 1]}\n").substr(0, 3), ":2:");
  EXPECT_EQ(refusedFor("joints", "joint").substr(0, 18), ":3: unknown key 'j");
  EXPECT_THROW(loadTurret(folder.path("nowhere.yaml")), std::runtime_error);
}

}  // namespace
}  // namespace afterglow::calib::turret_test
