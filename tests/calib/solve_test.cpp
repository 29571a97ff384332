#include "calib/solver/solve.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "tests/support/synthetic_rig.hpp"

namespace afterglow::calib::solve_test {
namespace {

using test::RigKind;
using test::SyntheticRig;

constexpr RigKind kKinds[] = {RigKind::Standard, RigKind::LensShift, RigKind::Wide,
                              RigKind::ShortThrow};
/// What a camera and the detector's refit leave, px.
constexpr double kSigma_px = 0.02;

Calibration solved(const SyntheticRig& rig, const std::vector<View>& views) {
  return solveViews(views, rig.board, rig.pattern, rig.camera);
}

/// Every third projected tag and every other printed one: as good for a test, and quicker.
std::vector<View> thinned(std::vector<View> views) {
  const auto keepEach = [](std::vector<SeenTag>& tags, std::size_t nth) {
    std::vector<SeenTag> kept;
    for (std::size_t i = 0; i < tags.size(); i += nth) kept.push_back(tags[i]);
    tags = kept;
  };
  for (View& view : views) {
    keepEach(view.projected, view.projected.size() > 6 ? 3 : 1);
    keepEach(view.board, 2);
  }
  return views;
}

TEST(Solve, recoversEveryKindOfRig) {
  // On a short throw the board's free middle is as large as a tag or two.
  constexpr double kLargest_mm[] = {0.2, 0.2, 0.2, 0.8};
  for (RigKind kind : kKinds) {
    const SyntheticRig rig = test::makeRig(kind, 3);
    const Calibration result = solved(rig, thinned(test::cornerViews(rig, 16, kSigma_px, 3)));
    EXPECT_LT(test::errorP95_mm(rig, result.estimate), kLargest_mm[int(kind)]) << int(kind);
    EXPECT_LT(result.held_out_rms_px, 4 * kSigma_px) << "kind " << int(kind);
    EXPECT_LT(result.training_rms_px, result.held_out_rms_px) << "kind " << int(kind);
  }
}

TEST(Solve, keepsThePrincipalPointOutsideThePicture) {
  SyntheticRig rig = test::makeRig(RigKind::LensShift, 1);
  rig.projector.K(1, 2) = 1100;
  const Calibration result = solved(rig, test::cornerViews(rig, 12, kSigma_px, 1));
  EXPECT_NEAR(result.estimate.projector.K(1, 2), 1100, 10);
  EXPECT_LT(test::errorP95_mm(rig, result.estimate), 0.3);
}

TEST(Solve, takesTheRationalModelWhereTheLensNeedsIt) {
  SyntheticRig rig = test::makeRig(RigKind::Wide, 2);
  rig.projector = makeLens(1280, 800, rig.projector.K, {0.6, -0.2, 0, 0, 0.05, 0.95, 0.1, 0.02});
  const Calibration result = solved(rig, test::cornerViews(rig, 16, kSigma_px, 2));
  EXPECT_LT(result.held_out_rms_px, 4 * kSigma_px);
  EXPECT_LT(test::errorP95_mm(rig, result.estimate), 0.5);
}

TEST(Solve, seesThroughAFisheyeCamera) {
  SyntheticRig rig = test::makeRig(RigKind::Standard, 7);
  Eigen::Matrix3d K = rig.camera.K;
  K.topLeftCorner<2, 2>() *= 0.9;
  rig.camera = makeLens(rig.camera.width, rig.camera.height, K, {0.02, -0.03, 0.01, -0.004},
                        LensModel::Equidistant);
  const std::vector<View> views = thinned(test::cornerViews(rig, 16, kSigma_px, 7));
  const Calibration result = solved(rig, views);
  EXPECT_LT(test::errorP95_mm(rig, result.estimate), 0.3);
  EXPECT_LT(result.held_out_rms_px, 4 * kSigma_px);
  const Lens truth = rig.camera;
  rig.camera.K(0, 0) *= 1.01;
  rig.camera.K(1, 1) *= 1.01;
  SolveOptions options;
  options.camera_use = CameraUse::Refine;
  const Calibration refined = solveViews(views, rig.board, rig.pattern, rig.camera, options);
  EXPECT_NEAR(refined.camera.K(0, 0), truth.K(0, 0), 2);
  EXPECT_EQ(refined.camera.model, LensModel::Equidistant);
}

TEST(Solve, refinesTheCameraOnRequest) {
  SyntheticRig rig = test::makeRig(RigKind::Standard, 4);
  const std::vector<View> views = thinned(test::cornerViews(rig, 16, kSigma_px, 4));
  const Lens truth = rig.camera;
  rig.camera.K(0, 0) *= 1.01;  // what the camera_info says
  rig.camera.K(1, 1) *= 1.01;
  SolveOptions options;
  options.camera_use = CameraUse::Refine;
  const Calibration result = solveViews(views, rig.board, rig.pattern, rig.camera, options);
  EXPECT_NEAR(result.camera.K(0, 0), truth.K(0, 0), 2);
  EXPECT_NEAR(result.camera.K(1, 2), truth.K(1, 2), 2);
  // Everything after the refinement looks through the refined camera too.
  EXPECT_LT(result.held_out_rms_px, 4 * kSigma_px);
}

/// As calibrations of cameras are off.
Lens slightlyOff(Lens camera) {
  camera.K(0, 0) *= 1.002;
  camera.K(1, 1) *= 1.002;
  camera.K(0, 2) += 1;
  camera.K(1, 2) -= 1;
  return camera;
}

TEST(Solve, refinesACameraInfoThatTheViewsContradict) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 4);
  const std::vector<View> views = thinned(test::cornerViews(rig, 16, kSigma_px, 4));
  SyntheticRig given = rig;
  given.camera = slightlyOff(rig.camera);
  const Calibration result = solved(given, views);
  EXPECT_EQ(result.camera_change.fate, CameraFate::Refined);
  EXPECT_NEAR(result.camera.K(0, 0), rig.camera.K(0, 0), 0.5);
  EXPECT_NEAR(result.camera.K(0, 2), rig.camera.K(0, 2), 0.5);
  EXPECT_EQ(result.camera_info.K, given.camera.K);
  EXPECT_NEAR(result.camera_change.focal, 1 / 1.002 - 1, 5e-4);
  EXPECT_LT(test::errorP95_mm(rig, result.estimate), 0.3);
  // What is stated knows of the camera: neither blind nor afraid.
  EXPECT_GT(result.predicted_mm, 0.7 * test::errorP95_mm(rig, result.estimate));
  EXPECT_LT(result.predicted_mm, 1.0);
  EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
}

TEST(Solve, saysThatACameraHeldFixedIsContradicted) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 4);
  SolveOptions options;
  options.camera_use = CameraUse::Hold;
  const Lens given = slightlyOff(rig.camera);
  const Calibration result = solveViews(thinned(test::cornerViews(rig, 16, kSigma_px, 4)),
                                        rig.board, rig.pattern, given, options);
  EXPECT_EQ(result.camera.K, given.K);
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_EQ(result.warnings[0].rfind("the pictures contradict the camera_info, which was held "
                                     "fixed (fx is 0.",
                                     0),
            0u)
      << result.warnings[0];
}

TEST(Solve, keepsACameraInfoThatTheViewsAgreeWith) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 4);
  const std::vector<View> views = thinned(test::cornerViews(rig, 16, kSigma_px, 4));
  SolveOptions options;
  options.camera_use = CameraUse::Hold;
  const Calibration held = solveViews(views, rig.board, rig.pattern, rig.camera, options);
  const Calibration result = solved(rig, views);
  EXPECT_EQ(result.camera_change.fate, CameraFate::Agrees);
  EXPECT_EQ(result.camera.K, rig.camera.K);
  EXPECT_NEAR(test::errorP95_mm(rig, result.estimate), test::errorP95_mm(rig, held.estimate), 1e-4);
  // Nobody knows that it is exact.
  EXPECT_GT(result.predicted_mm, 2 * held.predicted_mm);
}

TEST(Solve, tellsAndRefusesCameraInfosThatAreFarOff) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 4);
  const std::vector<View> views = thinned(test::cornerViews(rig, 16, kSigma_px, 4));
  SyntheticRig given = rig;
  given.camera.K.topLeftCorner<2, 2>() *= 1.02;
  const Calibration result = solved(given, views);
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_EQ(result.warnings.back().rfind("the camera_info is further off than a calibrated "
                                         "camera's is (fx is 1.9",
                                         0),
            0u)
      << result.warnings.back();
  given.camera.K.topLeftCorner<2, 2>() *= 1.06;
  try {
    solved(given, views);
    FAIL() << "not refused";
  } catch (const CalibrationRefused& refused) {
    ASSERT_EQ(refused.reasons().size(), 1u) << refused.what();
    EXPECT_NE(refused.reasons()[0].find("is the camera_info this camera's"), std::string::npos)
        << refused.what();
  }
}

TEST(Solve, reckonsWithABoardThatSagsAndIsTwisted) {
  SyntheticRig rig = test::makeRig(RigKind::Standard, 4);
  rig.sag_m = 0.001;
  rig.twist_m = 0.001;
  SyntheticRig given = rig;
  given.camera = slightlyOff(rig.camera);
  const Calibration result = solved(given, thinned(test::cornerViews(rig, 16, kSigma_px, 4)));
  EXPECT_LT(test::errorP95_mm(rig, result.estimate), 0.3);
  EXPECT_NEAR(result.board_shape.bends().x(), 0.001, 1e-4);
  EXPECT_NEAR(result.board_shape.bends().y(), 0, 1e-4);
  EXPECT_NEAR(result.board_shape.twist(), 0.001, 1e-4);
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_EQ(result.warnings[0].rfind("the board bends by 1.0 mm over its width and is twisted by "
                                     "1.0 mm, which was reckoned with",
                                     0),
            0u)
      << result.warnings[0];
}

TEST(Solve, refinesWithFiveViewsACalibrationOfAProjectorThatWasBumped) {
  SyntheticRig rig = test::makeRig(RigKind::Standard, 4);
  SolveOptions options;
  options.start = solved(rig, thinned(test::cornerViews(rig, 16, kSigma_px, 4))).estimate;
  rig.projector.K(0, 0) *= 1.001;  // warm
  rig.projector.K(1, 1) *= 1.001;
  rig.projector.K(1, 2) += 2;
  Eigen::Isometry3d bumped = rig.T_world_projector.matrix();
  bumped.translate(Eigen::Vector3d(0.003, -0.002, 0.004));
  bumped.rotate(Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitY()));
  rig.T_world_projector = Rigid<World, Projector>(bumped);
  EXPECT_GT(test::errorP95_mm(rig, *options.start), 20);
  const std::vector<View> views = thinned(test::cornerViews(rig, 5, kSigma_px, 8));
  const Calibration result = solveViews(views, rig.board, rig.pattern, rig.camera, options);
  EXPECT_LT(test::errorP95_mm(rig, result.estimate), 0.3);
  rig.projector.K.topLeftCorner<2, 2>() *= 1.1;  // zoomed
  try {
    solveViews(thinned(test::cornerViews(rig, 5, kSigma_px, 8)), rig.board, rig.pattern, rig.camera,
               options);
    FAIL() << "not refused";
  } catch (const CalibrationRefused& refused) {
    EXPECT_EQ(refused.reasons()[0].rfind("the projector's lens is not that of the calibration", 0),
              0u)
        << refused.what();
  }
}

TEST(Solve, refusesABoardThatIsBentTooFar) {
  SyntheticRig rig = test::makeRig(RigKind::Standard, 4);
  rig.sag_m = 0.012;
  try {
    solved(rig, thinned(test::cornerViews(rig, 16, kSigma_px, 4)));
    FAIL() << "not refused";
  } catch (const CalibrationRefused& refused) {
    EXPECT_EQ(refused.reasons()[0].rfind("the board bends by 12.", 0), 0u) << refused.what();
  }
}

TEST(Solve, isNotMovedByThreeWrongTagsOfTen) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 4);
  std::vector<View> views = test::cornerViews(rig, 12, kSigma_px, 4);
  const double clean = test::errorP95_mm(rig, solved(rig, views).estimate);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> share(0, 1), offset(-30, 30);
  for (View& view : views) {
    for (SeenTag& tag : view.projected) {
      if (share(random) >= 0.3) continue;
      const double x = offset(random);
      const Eigen::Vector2d by(x, offset(random));
      for (Eigen::Vector2d& corner : tag.corners) corner += by;
    }
  }
  const Calibration result = solved(rig, views);
  // What is left are seven tenths of the evidence.
  EXPECT_LT(test::errorP95_mm(rig, result.estimate), 1.5 * clean + 0.02);
}

TEST(Solve, namesAndLeavesOutTwoSpoiltViewsOfSixteen) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 5);
  const std::vector<test::BoardPose> poses = test::boardPoses(rig, 16, 5);
  std::vector<View> views = thinned(test::cornerViews(rig, 16, kSigma_px, 5)), good = views;
  // The printed tags of one moment, the projected ones of another, 3 cm on.
  for (std::size_t spoiled : {4u, 11u}) {
    Eigen::Isometry3d moved = poses[spoiled].matrix();
    moved.translation() += Eigen::Vector3d(0.02, -0.03, 0.02);
    views[spoiled].projected =
        test::cornerView(rig, "", test::BoardPose(moved), kSigma_px, 1).projected;
  }
  good.erase(good.begin() + 11);
  good.erase(good.begin() + 4);
  const Calibration result = solved(rig, views);
  for (const ViewResult& view : result.views) {
    const bool is_spoilt = view.name == "view_04" || view.name == "view_11";
    EXPECT_EQ(view.is_used, !is_spoilt) << view.name << " " << view.reason;
    if (is_spoilt) {
      EXPECT_NE(view.reason.find("move"), std::string::npos) << view.reason;
    }
  }
  EXPECT_LT(test::errorP95_mm(rig, result.estimate),
            1.05 * test::errorP95_mm(rig, solved(rig, good).estimate) + 0.002);
}

TEST(Solve, givesTheSameAnswerTwice) {
  const SyntheticRig rig = test::makeRig(RigKind::Wide, 6);
  const std::vector<View> views = test::cornerViews(rig, 8, kSigma_px, 6);
  const Calibration a = solved(rig, views), b = solved(rig, views);
  EXPECT_EQ(a.estimate.projector.K, b.estimate.projector.K);
  EXPECT_EQ(a.estimate.projector.D, b.estimate.projector.D);
  EXPECT_EQ(a.estimate.T_camera_projector.matrix().matrix(),
            b.estimate.T_camera_projector.matrix().matrix());
  EXPECT_EQ(a.estimate.covariance, b.estimate.covariance);
  EXPECT_EQ(a.held_out_rms_px, b.held_out_rms_px);
}

/// Squared distance of the truth from the estimate, in standard deviations.
double squaredDeviation(const SyntheticRig& rig, const ProjectorEstimate& estimate,
                        const Eigen::Vector3d& p_camera) {
  const ProjectorEstimate truth = rig.truth();
  const Eigen::Vector2d meant =
      project(truth.projector, truth.T_camera_projector.inverse() * p_camera).value();
  const PredictedPixel predicted = predictPixel(estimate, p_camera).value();
  const Eigen::Vector2d error = predicted.pixel - meant;
  return error.dot(predicted.covariance.inverse() * error);
}

/// A camera_info off by what the solver takes camera_infos to be off.
Lens calibratedCamera(const Lens& truth, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const CameraDeviations usual = usualDeviations(truth);
  Lens given = truth;
  const double focal = 1 + usual.focal * normal(random), aspect = usual.aspect * normal(random);
  given.K(0, 0) *= focal * (1 + aspect / 2);
  given.K(1, 1) *= focal * (1 - aspect / 2);
  given.K(0, 2) += usual.center_px * normal(random);
  given.K(1, 2) += usual.center_px * normal(random);
  for (std::size_t i = 0; i < 4; ++i) given.D[i] += usual.D[i] * normal(random);
  given.fold_radius = foldRadius(given);
  return given;
}

TEST(Solve, knowsHowSureItIs) {
  // One rig is one trial: its points err together.
  constexpr int kRigs = 40, kPoints = 20;
  constexpr double kEllipse95 = 5.991;  // chi-square of two degrees of freedom
  int inside_first = 0, inside_all = 0;
  double mean = 0;
  for (int i = 0; i < kRigs; ++i) {
    const auto seed = static_cast<std::uint32_t>(100 + i);
    const SyntheticRig rig = test::makeRig(kKinds[i % 4], seed);
    SyntheticRig given = rig;
    given.camera = calibratedCamera(rig.camera, seed);
    const Calibration result = solved(given, thinned(test::cornerViews(rig, 10, 0.05, seed)));
    const auto points = test::pointsInBeam(rig, kPoints, seed);
    for (int k = 0; k < kPoints; ++k) {
      const double deviation = squaredDeviation(rig, result.estimate, points[std::size_t(k)]);
      mean += std::min(deviation, 20.0) / (kRigs * kPoints);
      if (deviation > kEllipse95) continue;
      ++inside_all;
      if (k == 0) ++inside_first;
    }
  }
  // Binomial(40, 0.95) is below 34 once in 300 times. Of all points the share varies less.
  EXPECT_GE(inside_first, 34);
  EXPECT_GE(inside_all, kRigs * kPoints * 90 / 100);
  // Neither bold nor timid: 2 is expected, with a deviation of at most 0.32.
  EXPECT_GT(mean, 1.2);
  EXPECT_LT(mean, 2.9);
  RecordProperty("inside_first", inside_first);
  RecordProperty("inside_all", inside_all);
  std::printf("inside: %d of %d rigs, %d of %d points; mean squared deviation %.2f\n", inside_first,
              kRigs, inside_all, kRigs * kPoints, mean);
}

}  // namespace
}  // namespace afterglow::calib::solve_test
