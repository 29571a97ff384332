// Every refusal of the calibration, provoked on simulated pictures (those about the evidence as a
// whole on simulated corners too, which are quick), and its text.
#include <gtest/gtest.h>

#include <memory>

#include "calib/detection/tag_detector.hpp"
#include "calib/solver/refusals.hpp"
#include "calib/solver/solve.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::calib::refusal_test {
namespace {

using test::BoardPose;
using test::Photographer;
using test::RigKind;
using test::SyntheticRig;

BoardPose moved(const BoardPose& pose, const Eigen::Vector3d& by_m) {
  Eigen::Isometry3d T = pose.matrix();
  T.translation() += by_m;
  return BoardPose(T);
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

/// A rig, a pose of its board, and pictures of it.
struct Scene {
  SyntheticRig rig = test::makeSmallRig(1);
  BoardPose pose = test::boardPoses(rig, 1, 2)[0];
  Photographer photographer{rig};
  Picture pattern = test::patternPicture(rig.pattern), gray = test::grayPicture(640, 400);
  Picture lit = photographer.photograph(pose, pattern, 1);
  Picture plain = photographer.photograph(pose, gray, 2);
};

/// Its scene is made once.
class Refused : public testing::Test {
 protected:
  static void SetUpTestSuite() { scene_ = std::make_unique<Scene>(); }
  static void TearDownTestSuite() { scene_.reset(); }

  Picture shot(const Picture& shown) const { return photographer.photograph(pose, shown, 3); }
  std::string faults(const Picture& with_pattern, const std::optional<Picture>& without) const {
    const ViewReader reader(rig.board, rig.pattern, rig.camera);
    return joined(reader.observe({"view_00", with_pattern, without}).faults);
  }
  /// What is said of a board other than the layout's.
  std::string faultsOf(const Board& printed) const {
    SyntheticRig other = rig;
    other.board = printed;
    const Photographer its(other);
    return faults(its.photograph(pose, pattern, 1), its.photograph(pose, gray, 2));
  }
  /// All that is refused of photographs of several poses.
  std::string refusal(const Picture& shown, const std::vector<BoardPose>& poses) const {
    std::vector<Photographs> photographs;
    for (const BoardPose& at : poses) {
      const int index = static_cast<int>(photographs.size());
      photographs.push_back({test::viewName(index),
                             photographer.photograph(at, shown, std::uint32_t(2 * index)),
                             photographer.photograph(at, gray, std::uint32_t(2 * index + 1))});
    }
    try {
      solvePhotographs(photographs, rig.board, rig.pattern, rig.camera);
    } catch (const CalibrationRefused& refused) {
      return refused.what();
    }
    return "";
  }

 private:
  static std::unique_ptr<Scene> scene_;

 protected:
  const SyntheticRig& rig = scene_->rig;
  const BoardPose& pose = scene_->pose;
  const Photographer& photographer = scene_->photographer;
  const Picture &pattern = scene_->pattern, &gray = scene_->gray;
  const Picture &lit = scene_->lit, &plain = scene_->plain;
};
std::unique_ptr<Scene> Refused::scene_;

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

// ------------------------------------------------------------------------------------ single views

TEST_F(Refused, nothingOfAGoodView) { EXPECT_EQ(faults(lit, plain), ""); }

TEST_F(Refused, nothingOfAGoodSinglePicture) { EXPECT_EQ(faults(lit, {}), ""); }

TEST_F(Refused, noFaintPatternAsALateFrame) {
  // Much light from the room: the pattern changes few pixels by more than noise may.
  SyntheticRig bright = rig;
  bright.ambient = 6;
  const Photographer its(bright);
  EXPECT_EQ(faults(its.photograph(pose, pattern, 1), its.photograph(pose, gray, 2)), "");
}

TEST_F(Refused, aSinglePictureWithThePatternOverThePrint) {
  SyntheticRig screen = rig;  // nothing of the board is left to read
  screen.camera.width = pattern.width;
  screen.camera.height = pattern.height;
  const ViewReader reader(rig.board, rig.pattern, screen.camera);
  const View view = reader.observe({"view_00", pattern, {}});
  EXPECT_SAYS(joined(view.faults), "take a second one while the projector shows plain gray");
}

TEST_F(Refused, aViewWithoutTheBoard) {
  const std::string text =
      faults(photographer.photograph({}, pattern, 1), photographer.photograph({}, gray, 2));
  EXPECT_SAYS(text, "none of the board's tags was read: hold the whole board into");
}

TEST_F(Refused, aMirroredPicture) {
  EXPECT_SAYS(faults(mirrored(lit), mirrored(plain)),
              "the picture is mirrored: turn off the camera's mirroring");
}

TEST_F(Refused, anotherBoard) {
  Board other = rig.board;
  for (Tag& tag : other.tags) tag.id += 500;
  const std::string text = faultsOf(other);
  EXPECT_SAYS(text, "unknown tags (500, 501, 502, 503, 504 and ");
  EXPECT_SAYS(text, "another board than the layout says?");
}

TEST_F(Refused, aBoardOfAnotherPaper) {
  Board a3 = makeBoard({0.42, 0.297});
  a3.size_m = rig.board.size_m;  // the photographer's sheet
  EXPECT_SAYS(
      faultsOf(a3),
      "the tags in the picture (40 to 59) are those of an A3 board; the layout (board.yaml) "
      "describes A2 with tags 0 to 19: use the board.yaml that was written with the printed "
      "board");
}

TEST_F(Refused, aBoardOfAnotherShape) {
  const std::string text = faultsOf(makeBoard({0.594, 0.5}));
  EXPECT_SAYS(text, "the printed tags do not lie as the layout (board.yaml) of the A2 board says");
}

TEST_F(Refused, aPatternOfAnotherResolutionOrKind) {
  for (const Pattern& shown : {makePattern(1920, 1200), makePattern(800, 500),
                               makePattern(640, 400, "tag36h11", PatternUse::Singles)}) {
    SCOPED_TRACE(shown.width);
    // Whatever its resolution, it fills the projector's picture.
    const std::string text = faults(shot(test::patternPicture(shown)), plain);
    EXPECT_SAYS(text,
                "the projected tags do not lie as the pattern (pattern.yaml) of 640 x 400 "
                "pixels says");
  }
}

TEST_F(Refused, aBoardOfAnotherFamily) {
  if (kTagFamilies.size() < 2) GTEST_SKIP() << "AprilTag is older than 3.2: it has one family";
  Board other = rig.board;
  other.family = "tag36h10";
  EXPECT_SAYS(faultsOf(other),
              "the picture's tags are of the family tag36h10, the layout says tag36h11");
}

TEST_F(Refused, tagsSeenAtTwoPlaces) {
  Board other = rig.board;
  for (Tag& tag : other.tags) {
    if (tag.id == 7) tag.id = 3;
  }
  EXPECT_SAYS(faultsOf(other), "tags seen at two places: 3:");
}

TEST_F(Refused, picturesTooBrightAndTooDark) {
  Picture bright = plain, dark = plain;
  for (std::uint8_t& level : bright.pixels) level = std::uint8_t(std::min(255, 6 * level));
  for (std::uint8_t& level : dark.pixels) level /= 128;
  EXPECT_SAYS(faults(bright, bright), "overexposed");
  EXPECT_SAYS(faults(bright, bright), "shorten the exposure");
  EXPECT_SAYS(faults(dark, dark), "underexposed");
}

TEST_F(Refused, aPatternProjectedFromBehind) {
  EXPECT_SAYS(faults(shot(mirrored(pattern)), plain),
              "the projected pattern is mirrored: set the projector to front projection");
}

TEST_F(Refused, aPatternOfAnotherFamily) {
  if (kTagFamilies.size() < 2) GTEST_SKIP() << "AprilTag is older than 3.2: it has one family";
  const Picture other = test::patternPicture(makePattern(640, 400, "tag36h10"));
  EXPECT_SAYS(faults(shot(other), plain), "the projected tags are of the family tag36h10");
}

TEST_F(Refused, aFrameOlderThanTheSwitch) {
  EXPECT_SAYS(faults(plain, shot(gray)), "both pictures show the same, without the pattern");
  EXPECT_SAYS(faults(lit, shot(pattern)), "both pictures show the pattern");
  EXPECT_SAYS(faults(plain, lit), "the pictures are exchanged");
  EXPECT_SAYS(faults(plain, lit), "wait longer after switching");
}

TEST_F(Refused, aBoardThatMovedBetweenThePictures) {
  const BoardPose after = moved(pose, {0.01, 0.01, -0.01});
  const std::string text = faults(photographer.photograph(after, pattern, 1), plain);
  EXPECT_SAYS(text, "the board moved between the two pictures (");
  EXPECT_SAYS(text, "keep still");
}

// ------------------------------------------------------------------------------- pictures together

TEST_F(Refused, oneViewAndParallelBoards) {
  EXPECT_SAYS(refusal(pattern, {pose}), "1 usable view: at least 3 are needed");
  std::vector<BoardPose> parallel;
  for (double step : {-0.08, -0.03, 0.03, 0.08}) {
    parallel.push_back(moved(pose, {step, std::abs(step), 0.3 * step}));
  }
  const std::string text = refusal(pattern, parallel);
  EXPECT_SAYS(text, "the boards are parallel (within ");
  EXPECT_SAYS(text, "tilt it left, right, up and down");
}

TEST_F(Refused, aProjectorWithKeystoneCorrection) {
  // The upper edge drawn in by a tenth on either side.
  Eigen::Matrix3d H;
  H << 1, 0.16, 0, 0, 0.8, 0, 0, 0.0005, 1;
  H = (Eigen::Translation2d(320, 400) * Eigen::Affine2d::Identity()).matrix() * H *
      (Eigen::Translation2d(-320, -400) * Eigen::Affine2d::Identity()).matrix();
  const std::string text = refusal(test::warped(pattern, H.inverse()), test::boardPoses(rig, 4, 3));
  EXPECT_SAYS(text, "keystone correction or a resolution that is not the projector's own");
}

TEST_F(Refused, aPatternStretchedToAnotherResolution) {
  // A 4:3 desktop on a 16:10 projector: what is shown is as wide as ever, and too low.
  Picture desktop = test::grayPicture(640, 480, 0);
  std::copy(pattern.pixels.begin(), pattern.pixels.end(), desktop.pixels.begin());
  const std::string text = refusal(desktop, test::boardPoses(rig, 4, 3));
  EXPECT_SAYS(text, "the projector's pixels are not square");
  EXPECT_SAYS(text, "keystone correction or a resolution that is not the projector's own");
}

// -------------------------------------------------------------------------------- corners together

std::string refusalOf(const std::vector<View>& views, const SyntheticRig& rig,
                      const SolveOptions& options = {}) {
  try {
    solveViews(views, rig.board, rig.pattern, rig.camera, options);
  } catch (const CalibrationRefused& refused) {
    return refused.what();
  }
  return "";
}

/// Only the projected tags between these columns of the projector's picture.
void keepTags(View& view, const Pattern& pattern, double left, double right) {
  std::vector<SeenTag> kept;
  for (const SeenTag& seen : view.projected) {
    for (const Tag& tag : pattern.tags) {
      const bool is_inside = tag.corners[0].x() >= left && tag.corners[1].x() <= right;
      if (tag.id == seen.id && is_inside) kept.push_back(seen);
    }
  }
  view.projected = kept;
}

TEST(Refusal, ofViewsThatSeeOneSideOnly) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 1);
  std::vector<View> views = test::cornerViews(rig, 16, 0.05, 1);
  for (View& view : views) keepTags(view, rig.pattern, 0, 400);
  const std::string text = refusalOf(views, rig);
  EXPECT_SAYS(text, "of the projector's picture");
  EXPECT_SAYS(text, "nothing was seen in the right third: hold the board there too");
}

TEST(Refusal, isAWarningWhereHalfOfThePictureWasSeen) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 1);
  std::vector<View> views = test::cornerViews(rig, 12, 0.05, 1);
  for (View& view : views) keepTags(view, rig.pattern, 0, 760);
  const Calibration result = solveViews(views, rig.board, rig.pattern, rig.camera);
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_SAYS(result.warnings[0], "nothing was seen in the right third of what the camera sees");
  EXPECT_SAYS(result.warnings[0], "do not trust what is projected there");
}

TEST(Refusal, ofAPatchOfThePicture) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 1);
  PosedView view{"view_00", rig.T_world_camera.inverse() * test::boardPoses(rig, 1, 1)[0], {}};
  for (int i = 0; i < 100; ++i) view.lit_px.emplace_back(300 + i, 300 + i % 7);
  const Reach reach = reachOf(rig.truth(), rig.camera, rig.pattern, {view});
  EXPECT_LT(reach.covered, 0.1);
  ASSERT_EQ(reachRefusals(reach).size(), 1u);
  EXPECT_SAYS(reachRefusals(reach)[0], "% of what the camera sees of the projector's picture");
}

TEST(Refusal, ofTooFewCorners) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 1);
  std::vector<View> views = test::cornerViews(rig, 5, 0.05, 1);
  for (View& view : views) {
    view.projected.resize(std::min<std::size_t>(1, view.projected.size()));
  }
  EXPECT_SAYS(refusalOf(views, rig), "projected corners were seen on the boards: at least 40");
}

TEST(Refusal, ofALayoutInMillimeters) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 1);
  SyntheticRig wrong = rig;
  for (Tag& tag : wrong.board.tags) {
    for (Eigen::Vector2d& corner : tag.corners) corner *= 1000;
  }
  wrong.board.size_m *= 1000;
  EXPECT_SAYS(refusalOf(test::cornerViews(rig, 5, 0.05, 1), wrong), "in meters");
}

TEST(Refusal, ofABoardPrintedTooWide) {
  const SyntheticRig nominal = test::makeRig(RigKind::Standard, 1);
  SyntheticRig printed = nominal;
  for (Tag& tag : printed.board.tags) {
    for (Eigen::Vector2d& corner : tag.corners) corner.x() *= 1.01;
  }
  const std::string text = refusalOf(test::cornerViews(printed, 8, 0.05, 1), nominal);
  EXPECT_SAYS(text, "the board is printed 1.0");
  EXPECT_SAYS(text, "% too wide for its height");
}

TEST(Refusal, ofAMeasuredRuler) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 1);
  ASSERT_DOUBLE_EQ(rig.board.ruler_m, 0.2);
  SolveOptions options;
  options.measured_ruler_m = 0.194;
  const std::vector<View> views = test::cornerViews(rig, 8, 0.05, 1);
  const std::string text = refusalOf(views, rig, options);
  EXPECT_SAYS(text, "the board is printed at 97.00 % of its size");
  EXPECT_SAYS(text, "\"actual size\"");
  options.measured_ruler_m = 200;
  EXPECT_SAYS(refusalOf(views, rig, options), "given in another unit");
  options.measured_ruler_m = 0.2002;
  EXPECT_EQ(refusalOf(views, rig, options), "");
}

TEST(Refusal, ofDistortionThatFoldsInsideThePicture) {
  const Eigen::Matrix3d K = test::makeRig(RigKind::Wide, 1).projector.K;
  EXPECT_TRUE(foldRefusals(makeLens(1280, 800, K, {-0.19, 0.06, 0, 0, -0.01})).empty());
  const std::vector<std::string> reasons =
      foldRefusals(makeLens(1280, 800, K, {-0.9, 0.0, 0, 0, 0}));
  ASSERT_EQ(reasons.size(), 1u);
  EXPECT_SAYS(reasons[0], "folds back inside the picture");
}

TEST(Refusal, ofAnUncertainResult) {
  const SyntheticRig rig = test::makeRig(RigKind::Standard, 1);
  const BoardPose pose = test::boardPoses(rig, 1, 1)[0];
  PosedView view{"view_00", rig.T_world_camera.inverse() * pose, {}};
  for (const Tag& tag : rig.pattern.tags) {
    if (test::lightOnBoard(rig, pose, tag.corners[0])) view.lit_px.push_back(tag.corners[0]);
  }
  ProjectorEstimate estimate = rig.truth();
  estimate.covariance.setZero();
  estimate.covariance(2, 2) = 0.04;  // cx to 0.2 px
  EXPECT_NEAR(predictedError(estimate, {view}).px, 0.2 * 2.4477, 1e-3);
  EXPECT_TRUE(uncertaintyRefusals(estimate, {view}).empty());
  estimate.covariance(2, 2) = 4;
  const auto reasons = uncertaintyRefusals(estimate, {view});
  ASSERT_EQ(reasons.size(), 1u);
  EXPECT_SAYS(reasons[0], "uncertain by 4.9 px (95 %)");
}

TEST(Refusal, ofPixelsThatAreNotSquareOnlyWhenThatIsSure) {
  const Lens lens = test::makeRig(RigKind::LensShift, 1).projector;
  EXPECT_TRUE(pixelShapeRefusals({1.002, 0.0005, 0, 0.001}, lens).empty());
  EXPECT_TRUE(pixelShapeRefusals({1.03, 0.02, 0, 0.001}, lens).empty());
  EXPECT_SAYS(joined(pixelShapeRefusals({1.03, 0.001, 0, 0.001}, lens)), "3.0 % higher than wide");
  EXPECT_SAYS(joined(pixelShapeRefusals({1 / 1.03, 0.001, 0, 0.001}, lens)),
              "3.0 % wider than high");
  EXPECT_SAYS(joined(pixelShapeRefusals({1, 0.001, 0.02, 0.001}, lens)), "lean by 1.1 deg");
  Lens far = lens;
  far.K(1, 2) = -1700;
  EXPECT_SAYS(joined(pixelShapeRefusals({1, 0.001, 0, 0.001}, far)), "more than any lens shift");
}

}  // namespace
}  // namespace afterglow::calib::refusal_test
