// Calibrations from simulated pictures: two spoiled views of sixteen are found, named and left out
// and do no harm; pictures without a plain one beside each do too.
#include <gtest/gtest.h>

#include "calib/solver/solve.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::calib::solve_photographs_test {
namespace {

struct Session {
  test::SyntheticRig rig = test::makeSmallRig(2);
  std::vector<Photographs> photographs;
};

/// Sixteen poses. The camera's plain picture of view_04 still shows the pattern; the board of
/// view_11 slips by 3 cm between its pictures.
Session spoiledSession() {
  Session session;
  const test::SyntheticRig& rig = session.rig;
  const test::Photographer photographer(rig);
  const Picture pattern = test::patternPicture(rig.pattern);
  const Picture gray = test::grayPicture(rig.projector.width, rig.projector.height);
  for (const test::BoardPose& pose : test::boardPoses(rig, 16, 2)) {
    const int index = static_cast<int>(session.photographs.size());
    Eigen::Isometry3d before = pose.matrix();
    if (index == 11) before.translation() += Eigen::Vector3d(0.02, 0.01, -0.02);
    session.photographs.push_back(
        {test::viewName(index),
         photographer.photograph(test::BoardPose(before), pattern, std::uint32_t(2 * index)),
         photographer.photograph(pose, index == 4 ? pattern : gray, std::uint32_t(2 * index + 1))});
  }
  return session;
}

TEST(SpoiledViews, areNamedAndLeftOut) {
  const Session session = spoiledSession();
  const test::SyntheticRig& rig = session.rig;
  const Calibration result =
      solvePhotographs(session.photographs, rig.board, rig.pattern, rig.camera);
  ASSERT_EQ(result.views.size(), 16u);
  for (const ViewResult& view : result.views) {
    const bool is_spoilt = view.name == "view_04" || view.name == "view_11";
    EXPECT_EQ(view.is_used, !is_spoilt) << view.name << ": " << view.reason;
    EXPECT_EQ(view.reason.empty(), !is_spoilt) << view.name << ": " << view.reason;
  }
  EXPECT_NE(result.views[4].reason.find("both pictures show the pattern"), std::string::npos);
  EXPECT_NE(result.views[4].reason.find("wait longer"), std::string::npos);
  EXPECT_NE(result.views[11].reason.find("the board"), std::string::npos);
  EXPECT_NE(result.views[11].reason.find("move"), std::string::npos) << result.views[11].reason;
  EXPECT_LT(test::errorP95_mm(rig, result.estimate), 0.5);
}

TEST(SinglePictures, calibrateUnderTheSparsePattern) {
  test::SyntheticRig rig = test::makeRig(test::RigKind::Standard, 3);
  rig.pattern = makePattern(rig.projector.width, rig.projector.height, rig.pattern.family,
                            PatternUse::Singles);
  const test::Photographer photographer(rig);
  const Picture pattern = test::patternPicture(rig.pattern);
  std::vector<Photographs> photographs;
  for (const test::BoardPose& pose : test::boardPoses(rig, 8, 3)) {
    const int index = static_cast<int>(photographs.size());
    photographs.push_back(
        {test::viewName(index), photographer.photograph(pose, pattern, std::uint32_t(index)), {}});
  }
  const Calibration result = solvePhotographs(photographs, rig.board, rig.pattern, rig.camera);
  EXPECT_LT(test::errorP95_mm(rig, result.estimate), 0.5);
}

}  // namespace
}  // namespace afterglow::calib::solve_photographs_test
