// `afterglow calibrate solve` as a user meets it, judged by the independent referee, which takes
// the photographs and knows the truth.
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/calibrate_command.hpp"
#include "tests/support/referee_program.hpp"

namespace afterglow::nodes::calibrate_solve_test {
namespace {

class SolveCommand : public test::CalibrateCommand {
 protected:
  ProgramResult referee(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {AFTERGLOW_TEST_PYTHON, test::kReferee});
    return runProgram(arguments);
  }
  ProgramResult solve(const std::string& images, const std::string& out) const {
    return calibrate({"solve", "--images", path(images), "--board", path("board/board.yaml"),
                      "--pattern", path("pattern/pattern.yaml"), "--camera",
                      path("views/camera.yaml"), "--out", path(out), "--json"});
  }
};

TEST_F(SolveCommand, calibratesWhatTheRefereePhotographed) {
  const std::string absence = test::refereeAbsence();
  if (!absence.empty()) GTEST_SKIP() << absence;
  ASSERT_EQ(calibrate({"board", "--out", path("board")}).status, 0);
  ASSERT_EQ(
      calibrate({"pattern", "--width", "1280", "--height", "800", "--out", path("pattern")}).status,
      0);
  const ProgramResult rig = referee({"rig", "--seed", "7", "--kind", "lens_shift"});
  ASSERT_EQ(rig.status, 0) << rig.output;
  std::ofstream(path("rig.yaml")) << rig.output;
  const ProgramResult dataset = referee(
      {"dataset", "--pattern", path("pattern/pattern.png"), "--board", path("board/board.yaml"),
       "--truth", path("rig.yaml"), "--views", "5", "--seed", "7", "--out", path("views")});
  ASSERT_EQ(dataset.status, 0) << dataset.output;

  const ProgramResult solved = solve("views", "calibration");
  ASSERT_EQ(solved.status, 0) << solved.output;
  const auto json = nlohmann::json::parse(solved.output);
  EXPECT_LT(json["held_out_rms_px"].get<double>(), 0.3);
  EXPECT_EQ(json["views"].size(), 5);
  EXPECT_TRUE(std::filesystem::exists(path("calibration/report.html")));
  // The bar of a whole set of 16 views; the five here see less of the beam.
  const ProgramResult judged =
      referee({"compare", "--truth", path("views/truth.yaml"), "--projector",
               path("calibration/projector.yaml"), "--pose",
               path("calibration/T_camera_projector.yaml"), "--max-p95-mm", "0.25"});
  EXPECT_EQ(judged.status, 0) << judged.output;

  // What it was solved from does not tell how good it is.
  expectRefused({"verify", "--images", path("views"), "--board", path("board/board.yaml"),
                 "--pattern", path("pattern/pattern.yaml"), "--calibration", path("calibration")},
                "view_00.png is one of the photographs that the calibration was solved from");

  // Two of them are too few, and what was there before stays.
  for (const char* view : {"view_00", "view_01"}) {
    std::filesystem::create_directories(path("two"));
    for (const char* kind : {".png", "_plain.png"}) {
      std::filesystem::copy(path("views/") + view + kind, path("two/") + view + kind);
    }
  }
  expectRefused({"solve", "--images", path("two"), "--board", path("board/board.yaml"), "--pattern",
                 path("pattern/pattern.yaml"), "--camera", path("views/camera.yaml"), "--out",
                 path("calibration")},
                "2 usable views: at least 3 are needed");
  EXPECT_EQ(referee({"compare", "--truth", path("views/truth.yaml"), "--projector",
                     path("calibration/projector.yaml"), "--pose",
                     path("calibration/T_camera_projector.yaml"), "--max-p95-mm", "0.25"})
                .status,
            0);
}

}  // namespace
}  // namespace afterglow::nodes::calibrate_solve_test
