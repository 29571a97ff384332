#include "nodes/calibrator/calibration_session.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/held_board.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::calibration_session_test {
namespace {

using namespace test;

class Session : public testing::Test {
 protected:
  void SetUp() override { files_.begin(); }
  /// One view, as the photographs of a board that is held still give it.
  void addView(const Pose& T_camera_board) {
    calib::View view;
    view.name = "view_00";
    for (std::size_t i = 0; i < 8; ++i) {
      calib::SeenTag tag;
      static_cast<Tag&>(tag) = smallPattern().tags[i];
      view.projected.push_back(tag);
    }
    const calib::Photographs photographs{view.name, {16, 16, std::vector<std::uint8_t>(256)}, {}};
    session_.addView(view, T_camera_board, photographs);
  }
  void solveOneView() {
    session_.begin(camera());
    addView(pose(0, 0, 1));
    ASSERT_TRUE(session_.solveNow().success);
  }

  TempFolder folder_;
  const CalibrationFolder files_{folder_.path("out")};
  CalibrationSession session_{smallBoard(), smallPattern(), {}, files_, true};
};

TEST_F(Session, waitsForTheCamera) {
  EXPECT_EQ(session_.state().phase, "waiting");
  EXPECT_TRUE(session_.awaitsCamera());
  EXPECT_FALSE(session_.takesViews());
  EXPECT_EQ(session_.takeView().message, "no views are being taken: call ~start first");
  session_.begin(camera());
  EXPECT_FALSE(session_.awaitsCamera());
  EXPECT_TRUE(session_.takesViews());
  EXPECT_EQ(session_.state().phase, "collecting");
}

TEST_F(Session, tellsWhereABoardShouldBeHeldNext) {
  session_.begin(camera());
  const std::vector<std::string> lit = session_.state().lit;
  ASSERT_EQ(lit.size(), 10u);
  EXPECT_EQ(lit[0], "+++++...........");
  EXPECT_EQ(lit[2], lit[0]);
  EXPECT_EQ(lit[3], "................");
}

TEST_F(Session, doesNotBeginOnceStopped) {
  EXPECT_EQ(session_.stop().message, "nothing was running");
  session_.begin(camera());
  EXPECT_FALSE(session_.takesViews());
  EXPECT_EQ(session_.state().phase, "idle");
  EXPECT_FALSE(session_.tell("nobody guides"));
}

TEST_F(Session, tellsAtTheStartWhyThereAreNoImages) {
  EXPECT_EQ(session_.start("").message, "started");
  EXPECT_EQ(session_.start("no camera").message, "starts as soon as it can; now: no camera");
}

TEST_F(Session, discardsTheLastViewOfItsPhotographs) {
  session_.begin(camera());
  EXPECT_FALSE(session_.discardLast().success);
  addView(pose(0, 0, 1));
  EXPECT_EQ(session_.discardLast().message, "view_00 is discarded");
  EXPECT_EQ(session_.state().views, 0);
}

TEST_F(Session, dropsTheSolutionOfAnEarlierStart) {
  solveOneView();
  const auto task = session_.task();
  ASSERT_TRUE(task);
  EXPECT_EQ(task->photographs.size(), 1u);
  EXPECT_TRUE(session_.awaitsSolution(task->start));
  ASSERT_TRUE(session_.start("").success);
  EXPECT_FALSE(session_.awaitsSolution(task->start));
  session_.solved(task->start, {}, "saved");
  EXPECT_FALSE(session_.calibration());
}

TEST_F(Session, goesOnToTheCheckOnceItIsSolved) {
  solveOneView();
  calib::Calibration calibration;
  calibration.held_out_rms_mm = 1.5;
  session_.solved(session_.task()->start, calibration, "saved in out");
  EXPECT_TRUE(session_.isVerifying());
  EXPECT_EQ(session_.state().held_out_mm, 1.5);
  calib::ErrorSummary errors;
  errors.corners = 4;
  errors.rms_mm = 0.5;
  EXPECT_TRUE(session_.addCheck(errors, ""));
  EXPECT_EQ(session_.state().phase, "done");
  EXPECT_EQ(session_.state().check_mm, 0.5);
}

TEST_F(Session, takesADelayOnlyWhileItIsMeasured) {
  calib::GuideOptions options;
  options.times_delay = true;
  CalibrationSession session(smallBoard(), smallPattern(), options, files_, true);
  session.begin(camera());
  session.timed(40, "forty");
  EXPECT_FALSE(session.state().delay_ms);
  EXPECT_FALSE(session.isTiming());
}

}  // namespace
}  // namespace afterglow::nodes::calibration_session_test
