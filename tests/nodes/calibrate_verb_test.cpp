// `afterglow calibrate board` and `pattern`, as a user meets them.
#include <gtest/gtest.h>

#include <filesystem>

#include "calib/targets/target_files.hpp"
#include "nodes/tools/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::calibrate_verb_test {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;

class CalibrateVerb : public testing::Test {
 protected:
  ProgramResult calibrate(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {AFTERGLOW_TEST_COMMAND, "calibrate"});
    return runProgram(arguments);
  }

  TempFolder folder_;
  std::string out_ = folder_.path("new/folder");
};

TEST_F(CalibrateVerb, writesAnA2BoardAndSaysWhatToDoWithIt) {
  const ProgramResult result = calibrate({"board", "--out", out_});
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.output,
            "board.pdf, board.png and board.yaml in " + out_ +
                ": 20 tags (tag36h11, ids 0 to 19) of 64 mm on a sheet of 594 x 420 mm\n"
                "Print board.pdf at 100 % (not \"fit to page\") and measure its ruler: 200 mm. "
                "Then glue it onto something flat and stiff.\n");
  EXPECT_TRUE(fs::exists(out_ + "/board.pdf"));
  EXPECT_TRUE(fs::exists(out_ + "/board.png"));
  EXPECT_EQ(calib::loadBoard(out_ + "/board.yaml").size_m, Eigen::Vector2d(0.594, 0.42));
}

TEST_F(CalibrateVerb, writesBoardsOfOtherSizesAndFamilies) {
  const ProgramResult a4 = calibrate({"board", "--out", out_, "--paper", "A4"});
  EXPECT_EQ(a4.status, 0);
  EXPECT_NE(a4.output.find("ids 20 to 39"), std::string::npos) << a4.output;
  EXPECT_EQ(calib::loadBoard(out_ + "/board.yaml").size_m, Eigen::Vector2d(0.297, 0.21));
  const std::string family = calib::kTagFamilies.back();
  EXPECT_EQ(calibrate({"board", "--out", out_, "--size", "0.8,0.6", "--family", family}).status, 0);
  const calib::Board board = calib::loadBoard(out_ + "/board.yaml");
  EXPECT_EQ(board.size_m, Eigen::Vector2d(0.8, 0.6));
  EXPECT_EQ(board.family, family);
}

TEST_F(CalibrateVerb, writesAPatternAndSaysWhatToDoWithIt) {
  const ProgramResult result =
      calibrate({"pattern", "--width", "1280", "--height", "800", "--out", out_});
  EXPECT_EQ(result.status, 0);
  const calib::Pattern pattern = calib::loadPattern(out_ + "/pattern.yaml");
  EXPECT_EQ(pattern.width, 1280);
  EXPECT_EQ(pattern.height, 800);
  EXPECT_EQ(result.output,
            "pattern.png and pattern.yaml in " + out_ + ": " + std::to_string(pattern.tags.size()) +
                " tags (tag36h11, ids 100 to " + std::to_string(pattern.tags.back().id) +
                ") on 1280 x 800 pixels\n"
                "Show pattern.png full screen, one pixel of it a pixel of the projector, with "
                "keystone correction and digital zoom off.\n");
  EXPECT_TRUE(fs::exists(out_ + "/pattern.png"));
}

TEST_F(CalibrateVerb, refusesWhatCannotBeInOneLine) {
  ProgramResult result = calibrate({"board", "--out", out_, "--size", "594,420"});
  EXPECT_EQ(result.status, 1);
  EXPECT_EQ(
      result.output,
      "afterglow calibrate board: a board of 594 x 420 m: expected 0.1 to 5 m a side (meters, "
      "not millimeters)\n");
  result = calibrate({"pattern", "--width", "0", "--height", "800", "--out", out_});
  EXPECT_EQ(result.status, 1);
  EXPECT_EQ(result.output,
            "afterglow calibrate pattern: a pattern of 0 x 800 pixels: expected 320 x 200 to 8192 "
            "x 8192\n");
  EXPECT_FALSE(fs::exists(out_));
}

TEST_F(CalibrateVerb, callsWrongUsageWrongUsage) {
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"board"},
      {"board", "--out", out_, "--size", "0.5"},
      {"board", "--out", out_, "--size", "0.5,0.4,0.3"},
      {"board", "--out", out_, "--size", "0.5x0.4"},
      {"board", "--out", out_, "--size", "0.5,0.4", "--paper", "A4"},
      {"board", "--out", out_, "--paper", "A5"},
      {"board", "--out", out_, "--family", "tag25h9"},
      {"pattern", "--out", out_, "--width", "1280"},
      {"pattern", "--out", out_, "--width", "1280", "--height", "tall"}};
  for (const auto& arguments : wrong) {
    const ProgramResult result = calibrate(arguments);
    EXPECT_EQ(result.status, 2) << testing::PrintToString(arguments) << result.output;
  }
  EXPECT_FALSE(fs::exists(out_));
}

}  // namespace
}  // namespace afterglow::nodes::calibrate_verb_test
