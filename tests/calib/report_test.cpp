// What a report tells of a calibration, before anybody makes a page of it.
#include "calib/report/report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/sample_calibration.hpp"

namespace afterglow::calib::report_test {
namespace {

constexpr const char* kDate = "2026-11-21T04:30:00Z";

std::vector<CalibrationRecord> historyOf(const Calibration& calibration) {
  CalibrationRecord first{"2026-08-03T10:00:00Z", calibration.estimate, 0.31, 0.22, 12};
  CalibrationRecord second{"2026-10-11T16:45:00Z", calibration.estimate, 0.26, 0.17, 16};
  first.estimate.projector.K(0, 2) += 2;  // light moves by two pixels to the next
  return {first, second};
}

TEST(Report, tellsTheHeldOutErrorAndWhatWasLeftOut) {
  const Calibration calibration = test::sampleCalibration();
  const auto data = reportData(calibration, {}, kDate);
  EXPECT_EQ(data["held_out"]["rms_mm"], calibration.held_out_rms_mm);
  EXPECT_EQ(data["held_out"]["view_count"], 14);
  EXPECT_EQ(data["light"]["mm"], calibration.light[1].mm);
  EXPECT_EQ(data["light"]["distance_m"], 2);
  EXPECT_EQ(data["board_text"], "bends by 1.1 mm over its width");
  EXPECT_EQ(data["used_count"], 14);
  EXPECT_EQ(data["view_count"], 16);
  ASSERT_EQ(data["left_out"].size(), 2u);
  EXPECT_EQ(data["left_out"][0]["name"], "view_14");
  EXPECT_EQ(data["views"][0]["held_out_px"], *calibration.views[0].held_out_px);
  EXPECT_EQ(data["views"][3]["outliers"], 1);
  Calibration empty;
  empty.estimate.projector = calibration.estimate.projector;
  EXPECT_TRUE(reportData(empty, {}, kDate)["held_out"].is_null());
  EXPECT_TRUE(reportData(empty, {}, kDate)["light"].is_null());
}

TEST(Report, givesParametersTwoDigitsOfTheirDeviation) {
  const auto data = reportData(test::sampleCalibration(), {}, kDate);
  const auto& fx = data["lens"]["parameters"][0];
  EXPECT_EQ(fx["name"], "fx");
  EXPECT_EQ(fx["value"].get<std::string>().rfind("1903.", 0), 0u);
  EXPECT_EQ(fx["deviation"].get<std::string>().rfind("± ", 0), 0u);
  EXPECT_EQ(data["pose"]["parameters"].size(), 6u);
}

TEST(Report, tellsHowFarLightMovedSinceTheLast) {
  const Calibration calibration = test::sampleCalibration();
  const auto history = reportData(calibration, historyOf(calibration), kDate)["history"];
  ASSERT_EQ(history.size(), 3u);
  EXPECT_TRUE(history[0]["moved"].is_null());
  EXPECT_NEAR(history[1]["moved"]["px"].get<double>(), 2, 1e-6);
  EXPECT_NEAR(history[1]["moved"]["mm"].get<double>(), 2 * 2000 / 1903.27, 0.05);
  EXPECT_NEAR(history[2]["moved"]["px"].get<double>(), 0, 1e-6);
  EXPECT_EQ(history[2]["date"], kDate);
}

TEST(Report, countsACalibrationThatIsSavedAlreadyOnce) {
  const Calibration calibration = test::sampleCalibration();
  std::vector<CalibrationRecord> saved = historyOf(calibration);
  saved.push_back({kDate, calibration.estimate, 0.2034, 0.1261, 14});
  EXPECT_EQ(reportData(calibration, saved, kDate)["history"].size(), 3u);
}

TEST(UncertaintyGrid, holdsWhatPredictPixelSays) {
  const ProjectorEstimate estimate = test::sampleCalibration().estimate;
  const UncertaintyGrid grid = uncertaintyGrid(estimate, 2);
  const int column = grid.columns / 2, row = grid.rows / 2;
  const Eigen::Vector2d pixel((column + 0.5) * grid.cell_px.x() - 0.5,
                              (row + 0.5) * grid.cell_px.y() - 0.5);
  const Eigen::Vector3d p_projector = *unproject(estimate.projector, pixel) * 2;
  const auto predicted = predictPixel(estimate, estimate.T_camera_projector * p_projector);
  ASSERT_TRUE(predicted);
  EXPECT_NEAR((predicted->pixel - pixel).norm(), 0, 1e-6);
  // Largest eigenvalue of a symmetric 2 x 2, and 95 % of a two-dimensional normal distribution.
  const Eigen::Matrix2d& C = predicted->covariance;
  const double half_trace = C.trace() / 2;
  const double largest = half_trace + std::sqrt(half_trace * half_trace - C.determinant());
  const double radius_px = std::sqrt(5.991464547 * largest);
  ASSERT_TRUE(grid.at(column, row));
  EXPECT_NEAR(grid.at(column, row)->px, radius_px, 1e-6 * radius_px);
  // Near the axis a pixel is z / f wide, but for a few percent of distortion.
  const double mm = 1000 * radius_px * 2 / estimate.projector.K(0, 0);
  EXPECT_NEAR(grid.at(column, row)->mm, mm, 0.05 * mm);
}

}  // namespace
}  // namespace afterglow::calib::report_test
