#include "nodes/fetch/robot_model.hpp"

#include <gtest/gtest.h>

#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl_parser/kdl_parser.hpp>
#include <random>

#include "nodes/fetch/fetch_facts.hpp"
#include "tests/support/fetch_poses.hpp"

namespace afterglow::nodes::robot_model_test {
namespace {

using test::armOverTable, test::linkPoses;

constexpr double kPi = 3.14159265358979323846;

const RobotModel& fetch() {
  static const RobotModel model = RobotModel::fromFile("assets/fetch.urdf");
  return model;
}

/// Anything in [-1, 1], the same on every machine.
double unit(std::mt19937& random) { return random() / 4294967295.0 * 2 - 1; }

/// Somewhere in the middle `part` of every joint's range.
JointPositions somewhere(std::mt19937& random, double part = 1) {
  JointPositions positions = fetch().restPositions();
  for (auto& [name, position] : positions) {
    const Joint& joint = fetch().joint(name);
    const bool endless = joint.kind == Joint::Kind::Continuous;
    const double lower = endless ? -kPi : joint.lower, upper = endless ? kPi : joint.upper;
    position = (lower + upper) / 2 + part * unit(random) * (upper - lower) / 2;
  }
  return positions;
}

void expectNear(const Eigen::Isometry3d& is, const Eigen::Isometry3d& expected, double tolerance) {
  EXPECT_LT((is.translation() - expected.translation()).norm(), tolerance)
      << is.translation().transpose() << " instead of " << expected.translation().transpose();
  EXPECT_LT(Eigen::AngleAxisd(is.linear().transpose() * expected.linear()).angle(), tolerance);
}

std::string refusal(const std::string& xml) {
  try {
    RobotModel::fromXml(xml, "some.urdf");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(RobotModel, addsUpLinkLengthsOfAStretchedArm) {
  const LinkPoses T_base = linkPoses(fetch(), {});
  // All along x: torso -0.086875, shoulder, then every link of the arm.
  const double x = -0.086875 + 0.119525 + 0.117 + 0.219 + 0.133 + 0.197 + 0.1245 + 0.1385 + 0.16645;
  const double z = 0.37743 + 0.34858 + 0.06;
  EXPECT_LT((T_base.at("gripper_link").translation() - Eigen::Vector3d(x, 0, z)).norm(), 1e-9);
  EXPECT_TRUE(T_base.at("gripper_link").linear().isIdentity(1e-9));
}

TEST(RobotModel, liftsAndTurnsWithTheJoints) {
  const JointPositions q = {{"torso_lift_joint", 0.3}, {"shoulder_pan_joint", kPi / 2}};
  const LinkPoses T_base = linkPoses(fetch(), q);
  const double reach = 0.117 + 0.219 + 0.133 + 0.197 + 0.1245 + 0.1385 + 0.16645;
  const Eigen::Vector3d expected(-0.086875 + 0.119525, reach, 0.37743 + 0.3 + 0.34858 + 0.06);
  EXPECT_LT((T_base.at("gripper_link").translation() - expected).norm(), 1e-9);
}

TEST(RobotModel, placesTheProjectorsOpticalFrame) {
  const Eigen::Isometry3d T = fetch().linkPose("projector_optical_frame", {});
  EXPECT_LT((T.linear().col(2) - Eigen::Vector3d::UnitX()).norm(), 1e-6);  // z looks ahead
  EXPECT_LT((T.linear().col(0) + Eigen::Vector3d::UnitY()).norm(), 1e-6);  // x to the right
  EXPECT_LT((T.linear().col(1) + Eigen::Vector3d::UnitZ()).norm(), 1e-6);  // y down
  EXPECT_GT(T.translation().z(), 1.2);
  EXPECT_LT(T.translation().z(), 1.5);
}

TEST(RobotModel, agreesWithKdlOnEveryLink) {
  KDL::Tree tree;
  ASSERT_TRUE(kdl_parser::treeFromFile("assets/fetch.urdf", tree));
  std::mt19937 random(2);
  for (int i = 0; i < 20; ++i) {
    const JointPositions q = somewhere(random);
    for (const Joint& joint : fetch().joints()) {
      KDL::Chain chain;
      ASSERT_TRUE(tree.getChain(fetch().rootLink(), joint.child, chain));
      KDL::JntArray array(chain.getNrOfJoints());
      unsigned k = 0;
      for (const KDL::Segment& segment : chain.segments)
        if (segment.getJoint().getType() != KDL::Joint().getType())
          array(k++) = q.at(segment.getJoint().getName());
      KDL::Frame frame;
      KDL::ChainFkSolverPos_recursive(chain).JntToCart(array, frame);
      double qx = 0, qy = 0, qz = 0, qw = 0;
      frame.M.GetQuaternion(qx, qy, qz, qw);
      const Eigen::Isometry3d expected =
          Eigen::Translation3d(frame.p.x(), frame.p.y(), frame.p.z()) *
          Eigen::Quaterniond(qw, qx, qy, qz);
      SCOPED_TRACE(joint.child);
      expectNear(fetch().linkPose(joint.child, q), expected, 1e-6);
    }
  }
}

TEST(RobotModel, reachesPosesItCanReachWithinItsLimits) {
  std::mt19937 random(3);
  int found = 0;
  for (int i = 0; i < 200; ++i) {
    const JointPositions truth = somewhere(random, 0.9);
    const Eigen::Isometry3d goal = fetch().linkPose(kGripperLink, truth);
    const auto solution = fetch().solveIk(kGripperLink, goal, tuckedArm());
    if (!solution) continue;
    ++found;
    expectNear(fetch().linkPose(kGripperLink, *solution), goal, 1e-4);
    for (const auto& [name, position] : *solution) {
      EXPECT_GE(position, fetch().joint(name).lower) << name;
      EXPECT_LE(position, fetch().joint(name).upper) << name;
    }
  }
  EXPECT_GE(found, 196);
}

TEST(RobotModel, findsTheSameJointsEveryTimeAndHoldsWhatItMust) {
  const Eigen::Isometry3d goal = fetch().linkPose(kGripperLink, armOverTable());
  JointPositions seed = tuckedArm();
  seed["torso_lift_joint"] = 0.15;
  const auto first = fetch().solveIk(kGripperLink, goal, seed, {"torso_lift_joint"});
  ASSERT_TRUE(first);
  EXPECT_EQ(first->size(), kArmWithTorsoJoints.size());
  EXPECT_EQ(first->at("torso_lift_joint"), 0.15);
  expectNear(fetch().linkPose(kGripperLink, *first), goal, 1e-4);
  EXPECT_EQ(*first, *fetch().solveIk(kGripperLink, goal, seed, {"torso_lift_joint"}));
}

TEST(RobotModel, staysAtASeedThatIsThereAlready) {
  const auto solution =
      fetch().solveIk(kGripperLink, fetch().linkPose(kGripperLink, armOverTable()), armOverTable());
  ASSERT_TRUE(solution);
  for (const auto& [name, position] : armOverTable())
    EXPECT_NEAR(solution->at(name), position, 1e-3) << name;
}

TEST(RobotModel, findsNothingOutOfReach) {
  Eigen::Isometry3d far = Eigen::Isometry3d::Identity();
  far.translation() = Eigen::Vector3d(3, 0, 1);
  EXPECT_FALSE(fetch().solveIk(kGripperLink, far, tuckedArm()));
  EXPECT_THROW(fetch().solveIk("nose", far, tuckedArm()), std::out_of_range);
}

TEST(RobotModel, aimsALensShiftedRayAtTableAndFloor) {
  const Eigen::Vector3d through_center(-0.5 / 1900, (399.5 - 817) / 1900, 1);
  for (const Eigen::Vector3d& target :
       {Eigen::Vector3d(0.6, 0, 0.72), Eigen::Vector3d(1.1, 0.3, 0.72), Eigen::Vector3d(0.8, 0, 0),
        Eigen::Vector3d(2, 0.6, 0), Eigen::Vector3d(1.4, -0.6, 0)}) {
    const auto angles = fetch().aim(kProjectorTurret, through_center, target, {});
    ASSERT_TRUE(angles) << target.transpose();
    const Eigen::Isometry3d T = fetch().linkPose(kProjectorTurret.frame, *angles);
    const Eigen::Vector3d ray = T.linear() * through_center.normalized();
    const Eigen::Vector3d to_target = target - T.translation();
    EXPECT_LT(ray.cross(to_target).norm(), 1e-5);  // passes within 10 um
    EXPECT_GT(ray.dot(to_target), 0);
    EXPECT_GT(T.linear().col(1).z(), -1.01);
    EXPECT_LT(T.linear().col(1).z(), 0) << "upside down";
  }
}

TEST(RobotModel, doesNotAimWhereTheLimitsForbidIt) {
  EXPECT_FALSE(fetch().aim(kHeadTurret, Eigen::Vector3d::UnitX(), {-2, 0, 1}, {}));
}

TEST(RobotModel, movesItsVisualsWithItsLinks) {
  const auto at = [](double lift) {
    return fetch().drawables(linkPoses(fetch(), {{"torso_lift_joint", lift}}));
  };
  const auto low = at(0), high = at(0.2);
  ASSERT_EQ(low.size(), fetch().visuals().size());
  int moved = 0;
  for (std::size_t i = 0; i < low.size(); ++i) {
    const double rise =
        high[i].pose.matrix().translation().z() - low[i].pose.matrix().translation().z();
    EXPECT_TRUE(std::abs(rise) < 1e-9 || std::abs(rise - 0.2) < 1e-9) << rise;
    moved += rise > 0.1;
  }
  EXPECT_GT(moved, 20);
}

TEST(RobotModel, takesMeshesFromWhoeverReadsThem) {
  const auto body = std::make_shared<const render::Body>();
  const RobotModel model = RobotModel::fromXml(
      "<robot name='r'><link name='a'>"
      "<visual><geometry><mesh filename='package://p/m.stl' scale='2 2 3'/></geometry></visual>"
      "<visual><geometry><mesh filename='package://p/none.stl'/></geometry></visual>"
      "</link></robot>",
      "some.urdf", [&](const std::string& resource) -> render::SharedBody {
        return resource == "package://p/m.stl" ? body : nullptr;
      });
  ASSERT_EQ(model.visuals().size(), 1u);
  const auto& mesh = std::get<render::MeshInstance>(model.visuals()[0].shape);
  EXPECT_EQ(mesh.body, body);
  EXPECT_EQ(mesh.scale, Eigen::Vector3f(2, 2, 3));
  EXPECT_TRUE(mesh.own_colors);
}

TEST(RobotModel, refusesWhatItCannotReadNamingTheReason) {
  EXPECT_EQ(refusal("<robot"), "some.urdf: not a URDF robot");
  EXPECT_EQ(refusal("<robot name='r'><link name='a'><visual><geometry><mesh filename='m.stl'/>"
                    "</geometry></visual></link></robot>"),
            "some.urdf: link a has a mesh; only boxes, cylinders and spheres are drawn");
  EXPECT_EQ(refusal("<robot name='r'><link name='a'/><link name='b'/><joint name='j' "
                    "type='floating'><parent link='a'/><child link='b'/></joint></robot>"),
            "some.urdf: joint j is neither fixed, revolute, continuous nor prismatic");
  EXPECT_THROW(RobotModel::fromFile("no/such.urdf"), std::runtime_error);
}

TEST(FetchFacts, namesJointsAndPosesTheRobotHas) {
  for (const JointPositions& pose : {tuckedArm(), armOverTable()}) {
    ASSERT_EQ(pose.size(), kArmWithTorsoJoints.size());
    for (const std::string& name : kArmWithTorsoJoints) {
      EXPECT_GE(pose.at(name), fetch().joint(name).lower) << name;
      EXPECT_LE(pose.at(name), fetch().joint(name).upper) << name;
    }
  }
  const Eigen::Isometry3d T = fetch().linkPose(kGripperLink, armOverTable());
  EXPECT_LT((T.translation() - Eigen::Vector3d(0.75, 0, 0.92)).norm(), 1e-3)
      << T.translation().transpose();
  EXPECT_GT(-T.linear().col(0).z(), 0.9999);  // fingers down
}

}  // namespace
}  // namespace afterglow::nodes::robot_model_test
