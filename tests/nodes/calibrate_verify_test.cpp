// `afterglow calibrate verify` as a user meets it. Photographer: the synthetic rig.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "calib/report/calibration_files.hpp"
#include "calib/targets/target_files.hpp"
#include "tests/support/calibrate_command.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::nodes::calibrate_verify_test {
namespace {

namespace fs = std::filesystem;

/// A finished calibration on disk, and what else verify asks for.
class VerifyCommand : public test::CalibrateCommand {
 protected:
  VerifyCommand() {
    calib::writeBoard(path("board"), rig_.board);
    calib::writePattern(path("pattern"), rig_.pattern);
    save("good", 0);
    save("bad", 2);
    write("camera.yaml", infoText(rig_.camera));
  }
  void save(const std::string& name, double shift_px) const {
    calib::Calibration calibration;
    calibration.estimate = rig_.truth();
    calibration.estimate.projector.K(0, 2) += shift_px;
    calibration.camera = rig_.camera;
    calib::saveCalibration(path(name), calibration, {}, "2026-11-21T04:30:00Z");
  }
  static std::string infoText(const calib::Lens& lens) {
    std::ostringstream text;
    text.precision(17);
    text << "image_width: " << lens.width << "\nimage_height: " << lens.height
         << "\ncamera_matrix: {rows: 3, cols: 3, data: [";
    for (int i = 0; i < 9; ++i) text << (i == 0 ? "" : ", ") << lens.K(i / 3, i % 3);
    text << "]}\ndistortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [";
    for (std::size_t i = 0; i < 5; ++i) text << (i == 0 ? "" : ", ") << lens.D[i];
    text << "]}\n";
    return text.str();
  }
  std::vector<std::string> views(const std::string& calibration) const {
    return {"verify",
            "--images",
            path("views"),
            "--board",
            path("board/board.yaml"),
            "--pattern",
            path("pattern/pattern.yaml"),
            "--camera",
            path("camera.yaml"),
            "--calibration",
            path(calibration)};
  }
  test::SyntheticRig rig_ = test::makeRig(test::RigKind::Standard, 1, 960);
};

TEST_F(VerifyCommand, measuresFreshViewsOfTheBoard) {
  const auto pose = test::boardPoses(rig_, 1, 4).front();
  const calib::Photographs shot = test::Photographer(rig_).photographs("view_00", pose, 1);
  fs::create_directories(path("views"));
  expectRefused(views("good"), "views: no photographs: expected view_00.png");
  calib::savePicture(path("views/view_00_plain.png"), *shot.plain);
  expectRefused(views("good"), "there is no view_00.png of the pattern to it");
  calib::savePicture(path("views/view_00.png"), shot.pattern);

  auto arguments = views("good");
  arguments.insert(arguments.end(), {"--json", "--max-p95-mm", "0.5"});
  const ProgramResult good = calibrate(arguments);
  ASSERT_EQ(good.status, 0) << good.output;
  const auto json = nlohmann::json::parse(good.output);
  EXPECT_EQ(json["method"], "views");
  EXPECT_LT(json["p95_mm"].get<double>(), 0.5);
  EXPECT_EQ(json["views"][0]["name"], "view_00");
  EXPECT_GT(json["views"][0]["corners"].get<int>(), 40);

  // The camera_info of before, with which the calibration was made and its camera refined.
  calib::Calibration refined;
  refined.estimate = rig_.truth();
  refined.camera = refined.camera_info = rig_.camera;
  refined.camera_info.K(0, 2) += 6;
  calib::saveCalibration(path("refined"), refined, {}, "2026-11-21T04:30:00Z");
  write("camera_info.yaml", infoText(refined.camera_info));
  arguments = views("refined");
  arguments.insert(arguments.end(), {"--max-p95-mm", "0.5"});
  for (const std::string& camera : {path("camera_info.yaml"), path("refined/camera.yaml")}) {
    arguments[8] = camera;
    const ProgramResult result = calibrate(arguments);
    EXPECT_EQ(result.status, 0) << camera << "\n" << result.output;
  }
  arguments.erase(arguments.begin() + 7, arguments.begin() + 9);
  const ProgramResult its_own = calibrate(arguments);
  EXPECT_EQ(its_own.status, 0) << its_own.output;

  arguments = views("bad");
  arguments.insert(arguments.end(), {"--max-p95-mm", "0.5"});
  const ProgramResult bad = calibrate(arguments);
  EXPECT_EQ(bad.status, 1);
  EXPECT_NE(bad.output.find("view_00"), std::string::npos) << bad.output;
  EXPECT_NE(bad.output.find("more than the 0.50 mm allowed by --max-p95-mm"), std::string::npos)
      << bad.output;
}

TEST_F(VerifyCommand, plansAThrowAndMeasuresIt) {
  std::string layout = "tags:\n";
  for (const calib::Tag& tag : rig_.board.tags) {
    std::ostringstream entry;
    entry << "  - {id: " << tag.id << ", corners: [";
    for (const auto& corner : tag.corners) entry << "[" << corner.x() << ", " << corner.y() << "],";
    layout += entry.str() + "]}\n";
  }
  const std::string targets = "targets:\n  - {id: 120, center: [0, 0], size: 0.11}\n";
  write("floor.yaml", layout + targets);
  const auto pose = test::boardPoses(rig_, 1, 4).front();
  const test::Photographer photographer(rig_);
  calib::savePicture(path("plain.png"),
                     photographer.photograph(
                         pose, test::grayPicture(rig_.projector.width, rig_.projector.height), 1));
  const ProgramResult plan = calibrate(
      {"verify", "--plan", "--targets", path("floor.yaml"), "--photograph", path("plain.png"),
       "--camera", path("camera.yaml"), "--calibration", path("good"), "--out", path("throw.png")});
  ASSERT_EQ(plan.status, 0) << plan.output;
  calib::savePicture(path("lit.png"),
                     photographer.photograph(pose, calib::loadPicture(path("throw.png")), 2));
  const std::vector<std::string> measure = {
      "verify",       "--thrown",        path("lit.png"), "--targets",        path("floor.yaml"),
      "--photograph", path("plain.png"), "--camera",      path("camera.yaml")};
  auto arguments = measure;
  arguments.insert(arguments.end(), {"--json", "--out", path("errors.png"), "--max-p95-mm", "0.5"});
  const ProgramResult result = calibrate(arguments);
  ASSERT_EQ(result.status, 0) << result.output;
  const auto json = nlohmann::json::parse(result.output);
  EXPECT_EQ(json["method"], "targets");
  EXPECT_EQ(json["targets"][0]["id"], 120);
  EXPECT_LT(json["targets"][0]["error_mm"].get<double>(), 0.5);
  EXPECT_TRUE(fs::exists(path("errors.png")));
  EXPECT_NE(calibrate(measure).output.find("median"), std::string::npos);
  write("more.yaml", layout + targets + "  - {id: 121, center: [0.15, 0], size: 0.08}\n");
  arguments = measure;
  arguments[4] = path("more.yaml");
  EXPECT_EQ(calibrate(arguments).status, 0) << "says so, but nobody asked for a judgment";
  arguments.insert(arguments.end(), {"--max-p95-mm", "0.5"});
  const ProgramResult fewer = calibrate(arguments);
  EXPECT_EQ(fewer.status, 1);
  EXPECT_NE(fewer.output.find("1 of the 2 targets not seen"), std::string::npos) << fewer.output;
  arguments = measure;
  arguments[2] = path("plain.png");
  const ProgramResult nothing = calibrate(arguments);
  EXPECT_EQ(nothing.status, 1);
  EXPECT_NE(nothing.output.find("none of the 1 targets is seen"), std::string::npos)
      << nothing.output;
}

TEST_F(VerifyCommand, endsWithTwoForWrongUsage) {
  expectWrongUsage({"verify", "--camera", "c"});
  expectWrongUsage({"verify", "--thrown", "t", "--targets", "t"});
  expectWrongUsage({"verify", "--camera", "c", "--images", "i"});
  expectWrongUsage({"verify", "--camera", "c", "--plan", "--thrown", "t"});
  expectWrongUsage({"verify", "--camera", "c", "--plan", "--targets", "t"});
  expectWrongUsage({"verify", "--camera", "c", "--thrown", "t", "--targets", "t", "--board", "b"});
}

}  // namespace
}  // namespace afterglow::nodes::calibrate_verify_test
