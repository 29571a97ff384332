#include "nodes/pages/calibration_page.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <locale>
#include <string>
#include <vector>

#include "calib/number_text.hpp"
#include "calib/report/report.hpp"
#include "tests/support/markup.hpp"
#include "tests/support/sample_calibration.hpp"

namespace afterglow::nodes::calibration_page_test {
namespace {

using calib::Calibration;
using calib::CalibrationRecord;
using calib::Coverage;
using calib::fixedText;
using calib::UncertaintyGrid;
using calib::ViewResult;
using test::markupProblem;

constexpr const char* kDate = "2026-11-21T04:30:00Z";

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

/// What pictures' letters and the style sheet's words spell is not the page's text.
std::string withoutPictures(std::string page) {
  const std::string start = "data:image/jpeg;base64,";
  for (auto at = page.find(start); at != std::string::npos; at = page.find(start, at)) {
    page.erase(at, page.find('"', at) - at);
  }
  const auto style = page.find("<style>");
  return page.erase(style, page.find("</style>") - style);
}

/// To look at a page: AFTERGLOW_SAVE_REPORT=FOLDER build/bin/calibration_page_test
void saveForPeople(const std::string& name, const std::string& page) {
  const char* folder = std::getenv("AFTERGLOW_SAVE_REPORT");
  if (folder != nullptr) std::ofstream(std::string(folder) + "/" + name) << page;
}

class CalibrationPage : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    calibration_ = new Calibration(test::sampleCalibration());
    page_ = new std::string(
        calibrationPage(*calibration_, test::samplePhotographs(*calibration_), history(), kDate));
    saveForPeople("report.html", *page_);
  }
  static void TearDownTestSuite() {
    delete calibration_;
    delete page_;
  }
  static std::vector<CalibrationRecord> history() {
    CalibrationRecord first{"2026-08-03T10:00:00Z", calibration_->estimate, 0.31, 0.22, 12};
    CalibrationRecord second{"2026-10-11T16:45:00Z", calibration_->estimate, 0.26, 0.17, 16};
    first.estimate.projector.K(0, 2) += 2;  // light moves by two pixels to the next
    return {first, second};
  }
  static void expectIn(const std::string& page, const std::string& part) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }

  static const Calibration* calibration_;
  static const std::string* page_;
};
const Calibration* CalibrationPage::calibration_ = nullptr;
const std::string* CalibrationPage::page_ = nullptr;

TEST_F(CalibrationPage, leadsWithTheLightInTheRoomThenTheHeldOutError) {
  const std::size_t light = page_->find("<div class=\"big\">0.087<small> mm</small></div>");
  const std::size_t large = page_->find("<div class=\"big\">0.13<small> mm</small></div>");
  const std::size_t training = page_->find("0.163 px");
  ASSERT_NE(light, std::string::npos);
  ASSERT_NE(large, std::string::npos);
  ASSERT_NE(training, std::string::npos);
  EXPECT_LT(light, large);
  EXPECT_LT(large, training);
  expectIn(*page_, "0.04 mm at 1 m, 0.09 mm at 2 m, 0.14 mm at 3 m (95 %)");
  expectIn(*page_, "0.203 px of the projector");
}

TEST_F(CalibrationPage, showsEveryViewWithItsErrors) {
  for (const ViewResult& view : calibration_->views) {
    expectIn(*page_, "<h3>" + view.name);
    if (!view.is_used) continue;
    expectIn(*page_, "<td class=\"n\">" + fixedText(view.projected_rms_px, 3) + "</td>");
    expectIn(*page_, "<td class=\"n\">" + fixedText(*view.held_out_px, 3) + "</td>");
    expectIn(*page_, "<td class=\"n\">" + fixedText(*view.held_out_mm, 3) + "</td>");
  }
  EXPECT_EQ(occurrences(*page_, "data:image/jpeg;base64,"), calibration_->views.size());
}

TEST_F(CalibrationPage, saysWhatWasLeftOutAndWhy) {
  for (const ViewResult& view : calibration_->views) {
    if (!view.is_used) expectIn(*page_, view.name + "</strong>: " + escaped(view.reason));
  }
  expectIn(*page_, escaped(calibration_->warnings.front()));
  expectIn(*page_, "14 of 16");
}

TEST_F(CalibrationPage, needsNothingFromOutside) {
  const std::string page = withoutPictures(*page_);
  for (const char* what : {"http", "<script", "<link", "@import", "src="}) {
    EXPECT_EQ(page.find(what), std::string::npos) << what;
  }
  std::size_t pictures = 0;
  for (auto at = page.find("href=\""); at != std::string::npos; at = page.find("href=\"", at + 1)) {
    const char first = page[at + 6];
    EXPECT_TRUE(first == '#' || first == '"') << page.substr(at, 80);
    pictures += first == '"' ? 1 : 0;
  }
  EXPECT_EQ(pictures, calibration_->views.size());
}

TEST_F(CalibrationPage, isWellFormedAndHoldsOnlyNumbers) {
  EXPECT_EQ(markupProblem(*page_), "");
  const std::string page = withoutPictures(*page_);
  EXPECT_EQ(page.find("nan"), std::string::npos);
  EXPECT_EQ(page.find("inf"), std::string::npos);
  EXPECT_EQ(markupProblem("\n<a><b></a>"), "closes none: a");
}

TEST_F(CalibrationPage, isTheSameWhereDecimalsHaveCommas) {
  struct CommaDecimals : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::locale before =
      std::locale::global(std::locale(std::locale::classic(), new CommaDecimals));
  const std::string elsewhere =
      calibrationPage(*calibration_, test::samplePhotographs(*calibration_), history(), kDate);
  std::locale::global(before);
  EXPECT_TRUE(elsewhere == *page_);
}

TEST_F(CalibrationPage, escapesNamesAndReasons) {
  Calibration calibration = *calibration_;
  calibration.views[0].name = "<b>\"x\" & y</b>";
  calibration.views[15].reason = "a < b\x01\xff";
  const std::string page = calibrationPage(calibration, {}, {}, kDate);
  EXPECT_EQ(page.find("<b>\"x\""), std::string::npos);
  expectIn(page, "&lt;b&gt;&quot;x&quot; &amp; y&lt;/b&gt;");
  expectIn(page, "a &lt; b\xEF\xBF\xBD\xEF\xBF\xBD");
  EXPECT_EQ(markupProblem(page), "");
}

TEST_F(CalibrationPage, marksOutliersAndStatesTheMagnification) {
  EXPECT_EQ(occurrences(*page_, "<circle"),
            2u);  // in the photograph and over the projector's picture
  expectIn(*page_, " times</strong> in every picture");
  expectIn(*page_, "</i>outlier</span>");
}

TEST_F(CalibrationPage, drawsTheUncertaintyInNumbers) {
  const UncertaintyGrid grid = uncertaintyGrid(calibration_->estimate, 2);
  const auto& middle = grid.at(grid.columns / 2, grid.rows / 2);
  ASSERT_TRUE(middle);
  const PageData map = heatMap(grid, HeatUnit::kPixels, calibration_->coverage,
                               calibration_->estimate.projector);
  const auto says = [&](const PageData& shape) {
    return shape.value("words", "") == twoDigits(middle->px);
  };
  EXPECT_TRUE(std::any_of(map["shapes"].begin(), map["shapes"].end(), says));
  expectIn(*page_, ">" + twoDigits(middle->px) + "</text>");
}

TEST_F(CalibrationPage, drawsTheBoardThatBends) {
  const PageData figure = boardFigure(calibration_->board_shape);
  EXPECT_EQ(figure["caption"],
            "The board bends by 1.1 mm over its width: millimeters above its mean plane, seen from "
            "its face.");
  expectIn(*page_, "<h2>The board’s shape</h2>");
  expectIn(*page_, ">−0.43<");  // its middle
  EXPECT_TRUE(boardFigure({}).is_null());
}

TEST_F(CalibrationPage, hatchesWhatWasNotMeasured) {
  const UncertaintyGrid grid = uncertaintyGrid(calibration_->estimate, 1);
  Coverage coverage;
  const auto hatched = [&] {
    const PageData map =
        heatMap(grid, HeatUnit::kMillimeters, coverage, calibration_->estimate.projector);
    return std::count_if(map["shapes"].begin(), map["shapes"].end(), [](const PageData& shape) {
      return shape["look"] == "unmeasured";
    });
  };
  EXPECT_EQ(hatched(), 160);
  coverage.corners[17] = 3;
  EXPECT_EQ(hatched(), 159);
}

TEST_F(CalibrationPage, tellsHowFarLightMovedSinceTheLast) {
  expectIn(*page_,
           "<td>2026-10-11 16:45</td><td class=\"n\">16</td><td class=\"n\">0.260</td>"
           "<td class=\"n\">0.170</td><td class=\"n\">2.00</td>");
  expectIn(*page_, "<td>2026-11-21 04:30</td><td class=\"n\">14</td>");
}

TEST_F(CalibrationPage, countsACalibrationThatIsSavedAlreadyOnce) {
  std::vector<CalibrationRecord> saved = history();
  saved.push_back({kDate, calibration_->estimate, 0.2034, 0.1261, 14});
  const std::string page = calibrationPage(*calibration_, {}, saved, kDate);
  EXPECT_EQ(occurrences(page, "<td>2026-11-21 04:30</td>"), 1u);
}

TEST_F(CalibrationPage, mentionsBoardAndPatternWhereTheyAreKnown) {
  calib::ReportFacts facts;
  facts.names.projector_name = "beamer & co";
  facts.board = calib::Board{};
  facts.board->size_m = {0.594, 0.42};
  facts.pattern = calib::Pattern{};
  facts.pattern->width = 1280;
  const std::string page = calibrationPage(*calibration_, {}, {}, kDate, facts);
  expectIn(page, "beamer &amp; co");
  expectIn(page, "594 × 420 mm");
  expectIn(page, "This is the first calibration kept in this folder.");
}

TEST_F(CalibrationPage, worksWithNothingToShow) {
  Calibration empty;
  empty.estimate.projector = calibration_->estimate.projector;
  empty.camera = calibration_->camera;
  const std::string page = calibrationPage(empty, {}, {}, kDate);
  EXPECT_EQ(markupProblem(page), "");
  expectIn(page, "not measured");
  expectIn(page, "has no covariance");
}

TEST_F(CalibrationPage, refusesWithReasonsFirstAndEveryViewAfter) {
  std::vector<ViewResult> views(calibration_->views.begin(), calibration_->views.begin() + 3);
  for (ViewResult& view : views) view.is_used = false;
  views[1].reason = "only 3 projected tags < 6; bring the board nearer";
  const calib::CalibrationRefused refused({"all boards are parallel; tilt them", "scale & print"},
                                          views);
  const auto photographs = test::samplePhotographs(*calibration_);
  const std::string page =
      refusalPage(refused, {photographs.begin(), photographs.begin() + 4}, kDate);
  saveForPeople("refusal.html", page);
  expectIn(page, "<li>all boards are parallel; tilt them</li><li>scale &amp; print</li>");
  EXPECT_LT(page.find("all boards are parallel"), page.find("view_00"));
  expectIn(page, "only 3 projected tags &lt; 6; bring the board nearer");
  expectIn(page, "view_03");
  EXPECT_EQ(occurrences(page, "data:image/jpeg;base64,"), 4u);
  EXPECT_EQ(markupProblem(page), "");
  EXPECT_EQ(withoutPictures(page).find("http"), std::string::npos);
}

}  // namespace
}  // namespace afterglow::nodes::calibration_page_test
