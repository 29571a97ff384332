// The held-out check: on the board, and with tags thrown on a surface. Photographer: the synthetic
// rig, whose truth is known.
#include <gtest/gtest.h>

#include <cmath>

#include "calib/verify/throw_picture.hpp"
#include "calib/verify/view_check.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/synthetic_rig.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::calib::verify_test {
namespace {

/// A table of 0.9 x 0.7 m with four printed tags and room for three of light.
TagLayout tableLayout() {
  TagLayout layout;
  layout.tags = {squareTag(3, {-0.36, 0.26}, 0.12, 0), squareTag(7, {0.36, 0.26}, 0.12, 0),
                 squareTag(8, {0.36, -0.26}, 0.12, 0), squareTag(21, {-0.36, -0.26}, 0.12, 0)};
  layout.targets = {squareTag(100, {0, 0}, 0.12, 0), squareTag(205, {-0.18, 0.1}, 0.1, 0.4),
                    squareTag(311, {0.2, -0.08}, 0.1, 2.5)};
  return layout;
}

/// The rig with a table for a board.
test::SyntheticRig rigWithTable(test::RigKind kind) {
  test::SyntheticRig rig = test::makeRig(kind, 3);
  rig.board.tags = tableLayout().tags;
  rig.board.size_m = {0.9, 0.7};
  rig.board.ruler_m = 0;
  return rig;
}

/// In the middle of the beam, 1.5 m away, tilted.
test::BoardPose tablePose(const test::SyntheticRig& rig) {
  const auto ray =
      *unproject(rig.projector, {rig.projector.width / 2.0, rig.projector.height / 2.0});
  const Eigen::Vector3d at = rig.T_world_projector * (1.5 * ray);
  const Eigen::Vector3d eyes =
      (rig.T_world_projector.matrix().translation() + rig.T_world_camera.matrix().translation()) /
      2;
  const Eigen::Vector3d normal = (eyes - at).normalized();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear().col(0) = Eigen::Vector3d(0, 1, 0.2).cross(normal).normalized();
  T.linear().col(1) = normal.cross(T.linear().col(0));
  T.linear().col(2) = normal;
  T.translation() = at;
  T.rotate(Eigen::AngleAxisd(-0.4, Eigen::Vector3d::UnitX()));
  return test::BoardPose(T);
}

/// The targets, thrown with an estimate and photographed.
struct Thrown {
  Picture plain, lit;
};
Thrown throwTargets(const test::SyntheticRig& rig, const TagLayout& layout,
                    const ProjectorEstimate& estimate) {
  const test::Photographer photographer(rig);
  const auto pose = tablePose(rig);
  Thrown thrown;
  thrown.plain = photographer.photograph(
      pose, test::grayPicture(rig.projector.width, rig.projector.height), 1);
  const SurfacePose surface = locateSurface(thrown.plain, layout, rig.camera);
  requireVisible(layout, rig.camera, surface.T_camera_surface);
  const Picture shown = drawThrow(layout, estimate.projector,
                                  estimate.T_camera_projector.inverse() * surface.T_camera_surface);
  thrown.lit = photographer.photograph(pose, shown, 2);
  return thrown;
}

ProjectorEstimate shifted(ProjectorEstimate estimate, double px) {
  estimate.projector.K(0, 2) += px;
  return estimate;
}

template <typename Function>
std::string fault(const Function& function) {
  try {
    function();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no fault";
}

TEST(Landing, isWhereThePixelsRayMeetsThePlane) {
  const Lens lens = test::lens(1280, 960, 1100, 650, 470, {-0.1, 0.05, 0.001, -0.001, 0});
  const auto T_world_camera = test::lookAt<Camera>({0.3, -0.5, 1.4}, {0.1, 0.4, 0});
  const Rigid<Camera, World> T_camera_world = T_world_camera.inverse();
  const Rigid<Camera, Surface> T_camera_floor(T_camera_world.matrix());
  const Eigen::Vector2d place(0.2, 0.35);
  const auto pixel = project(lens, T_camera_floor * Eigen::Vector3d(place.x(), place.y(), 0));
  ASSERT_TRUE(pixel);
  const auto found = landing(lens, *pixel, T_camera_floor);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - place).norm(), 1e-9);
  const auto upwards = test::lookAt<Camera>({0, 0, 1}, {1, 0, 1.5}).inverse();
  EXPECT_FALSE(landing(lens, {650, 470}, Rigid<Camera, Surface>(upwards.matrix())))
      << "the floor is behind";
}

TEST(ErrorSummary, hasNumpysQuantiles) {
  std::vector<LandingError> errors;
  for (int mm : {4, 1, 3, 2, 5}) errors.push_back({0, 0, {0, 0}, {mm / 1000.0, 0}});
  const ErrorSummary summary = summarize(errors);
  EXPECT_EQ(summary.corners, 5);
  EXPECT_NEAR(summary.median_mm, 3, 1e-9);
  EXPECT_NEAR(summary.p95_mm, 4.8, 1e-9);
  EXPECT_NEAR(summary.max_mm, 5, 1e-9);
  EXPECT_EQ(summarize({}).corners, 0);
}

TEST(TagLayout, knowsWhichTagsGetInEachOthersWay) {
  const Tag tag = squareTag(1, {0, 0}, 0.08, 0);
  EXPECT_TRUE(areTooClose(tag, squareTag(2, {0.095, 0}, 0.08, 0))) << "rim on rim";
  EXPECT_FALSE(areTooClose(tag, squareTag(2, {0.11, 0}, 0.08, 0)));
  EXPECT_TRUE(areTooClose(tag, squareTag(2, {0, 0}, 0.02, 0.3))) << "within";
  EXPECT_FALSE(areTooClose(tag, squareTag(2, {0.09, 0.09}, 0.08, M_PI / 4)))
      << "circles would touch";
  EXPECT_LT((middleOf(squareTag(1, {0.3, 0.4}, 0.1, 1)) - Eigen::Vector2d(0.3, 0.4)).norm(), 1e-12);
}

TEST(Verify, findsTheTrueCalibrationGoodOnTheBoardAndTwoPixelsBad) {
  const test::SyntheticRig rig = test::makeRig(test::RigKind::Standard, 1);
  const test::Photographer photographer(rig);
  const ViewReader reader(rig.board, rig.pattern, rig.camera);
  const auto poses = test::boardPoses(rig, 1, 4);
  std::vector<LandingError> good, bad;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const View view = reader.observe(
        photographer.photographs(test::viewName(int(i)), poses[i], 10 + unsigned(i)));
    const ViewCheck check = checkView(view, rig.board, rig.pattern, rig.camera, rig.truth());
    ASSERT_EQ(check.fault, "") << view.name;
    EXPECT_GT(check.errors.size(), 40u);
    good.insert(good.end(), check.errors.begin(), check.errors.end());
    const ViewCheck off =
        checkView(view, rig.board, rig.pattern, rig.camera, shifted(rig.truth(), 2));
    bad.insert(bad.end(), off.errors.begin(), off.errors.end());
  }
  EXPECT_LT(summarize(good).p95_mm, 0.5);
  // Boards are 1 to 1.8 m away, fx is about 1900: 2 px are 1 to 1.9 mm, more where tilted.
  EXPECT_GT(summarize(bad).median_mm, 0.9);
  EXPECT_LT(summarize(bad).median_mm, 2.6);
}

TEST(Verify, saysWhyAViewCannotBeMeasured) {
  const test::SyntheticRig rig = test::makeRig(test::RigKind::Standard, 1);
  View view = test::cornerView(rig, "view_00", test::boardPoses(rig, 1, 4)[0], 0.02, 1);
  const auto faultOf = [&](const View& v) {
    return checkView(v, rig.board, rig.pattern, rig.camera, rig.truth()).fault;
  };
  EXPECT_EQ(faultOf(view), "");
  View spoiled = view;
  spoiled.projected.clear();
  EXPECT_NE(faultOf(spoiled).find("no tag of the pattern lies on the board"), std::string::npos);
  spoiled = view;
  spoiled.board.resize(1);
  EXPECT_NE(faultOf(spoiled).find("only 1 printed tags"), std::string::npos);
  spoiled = view;
  spoiled.faults = {"the picture is mirrored"};
  EXPECT_EQ(faultOf(spoiled), "the picture is mirrored");
}

class ThrownTargets : public testing::TestWithParam<test::RigKind> {};

TEST_P(ThrownTargets, landWhereTheTrueCalibrationSays) {
  const test::SyntheticRig rig = rigWithTable(GetParam());
  const TagLayout layout = tableLayout();
  const Thrown thrown = throwTargets(rig, layout, rig.truth());
  for (const bool has_plain : {true, false}) {
    const ThrowCheck check = checkThrow(
        thrown.lit, has_plain ? std::optional(thrown.plain) : std::nullopt, layout, rig.camera);
    ASSERT_EQ(check.targets.size(), 3u);
    for (const TargetCheck& target : check.targets) {
      ASSERT_TRUE(target.is_seen) << target.id;
      EXPECT_LT(target.offset_mm.norm(), 0.3) << target.id;
    }
    EXPECT_LT(summarize(check.errors()).p95_mm, 0.5) << has_plain;
  }
}
INSTANTIATE_TEST_SUITE_P(Rigs, ThrownTargets,
                         testing::Values(test::RigKind::Wide, test::RigKind::ShortThrow));

TEST(ThrownTargets, showTwoPixelsAsTheMillimetersTheyAre) {
  const test::SyntheticRig rig = rigWithTable(test::RigKind::Standard);
  const TagLayout layout = tableLayout();
  const Thrown thrown = throwTargets(rig, layout, shifted(rig.truth(), 2));
  const ThrowCheck check = checkThrow(thrown.lit, thrown.plain, layout, rig.camera);
  const auto T_projector_table = rig.T_world_projector.inverse() * tablePose(rig);
  for (const TargetCheck& target : check.targets) {
    ASSERT_TRUE(target.is_seen);
    const auto tag = std::find_if(layout.targets.begin(), layout.targets.end(),
                                  [&](const Tag& t) { return t.id == target.id; });
    const Eigen::Vector2d place = middleOf(*tag);
    // What was meant for a pixel of the true lens was drawn two to its right.
    const auto meant =
        project(rig.projector, T_projector_table * Eigen::Vector3d(place.x(), place.y(), 0));
    const auto lands = landing(rig.projector, *meant + Eigen::Vector2d(2, 0), T_projector_table);
    const Eigen::Vector2d expected_mm = 1000 * (*lands - place);
    EXPECT_GT(expected_mm.norm(), 1.2);
    EXPECT_LT((target.offset_mm - expected_mm).norm(), 0.3) << target.id;
  }
  test::TempFolder folder;
  saveErrorPicture(folder.path("errors.png"), thrown.lit, check);
  const Picture drawn = loadPicture(folder.path("errors.png"));
  EXPECT_EQ(drawn.width, thrown.lit.width);
  EXPECT_NE(drawn.pixels, thrown.lit.pixels);
  EXPECT_NE(fault([&] {
              saveErrorPicture(folder.path("none/x.png"), thrown.lit, check);
            }).find("none/x.png"),
            std::string::npos);
}

TEST(ThrownTargets, areRefusedWithTheReason) {
  const test::SyntheticRig rig = rigWithTable(test::RigKind::Standard);
  TagLayout layout = tableLayout();
  const Picture plain = test::photograph(
      rig, tablePose(rig), test::grayPicture(rig.projector.width, rig.projector.height), 1);
  const auto T_camera_table = rig.T_world_camera.inverse() * tablePose(rig);
  const auto T_projector_table = rig.T_world_projector.inverse() * tablePose(rig);

  const auto contains = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  contains(fault([&] { locateSurface(test::grayPicture(1280, 960), layout, rig.camera); }),
           "0 of the layout's 4 printed tags are seen");
  contains(fault([&] { locateSurface(test::grayPicture(640, 480), layout, rig.camera); }),
           "640 x 480 pixels, the camera's file says 1280 x 960");
  TagLayout wrong = layout;
  wrong.tags[1] = squareTag(7, {0.36, 0.31}, 0.12, 0);
  contains(fault([&] { locateSurface(plain, wrong, rig.camera); }),
           "the printed tags do not lie as the layout says");
  Picture moved = plain;
  std::rotate(moved.pixels.begin(), moved.pixels.begin() + 5, moved.pixels.end());
  contains(fault([&] { checkThrow(moved, plain, layout, rig.camera); }),
           "the camera has moved between the two photographs: the printed tags by 5.0 px");
  const auto draw = [&] { drawThrow(layout, rig.projector, T_projector_table); };
  layout.targets = {squareTag(100, {3, 0}, 0.1, 0)};
  contains(fault(draw), "target 100 would be at pixel");
  contains(fault([&] { requireVisible(layout, rig.camera, T_camera_table); }), "the camera's");
  layout.targets = {squareTag(100, {0, 0}, 0.01, 0)};
  contains(fault(draw), "target 100: its cells would be");
  // Nothing thrown: seen is what is there, and that is none.
  const ThrowCheck check = checkThrow(plain, std::nullopt, tableLayout(), rig.camera);
  EXPECT_TRUE(check.errors().empty());
}

}  // namespace
}  // namespace afterglow::calib::verify_test
