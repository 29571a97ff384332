#include "nodes/tools/calibration_folder.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "calib/file_replacement.hpp"
#include "calib/report/calibration_files.hpp"
#include "nodes/pages/calibration_page.hpp"
#include "replay/query/time_text.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;
using replay::dateNow;

void makeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw std::runtime_error(folder.string() + ": cannot be made: " + error.message());
}

void keepIn(const fs::path& folder, const calib::Photographs& photographs) {
  makeFolder(folder);
  const std::string stem = (folder / photographs.name).string();
  calib::savePicture(stem + ".png", photographs.pattern);
  if (photographs.plain) calib::savePicture(stem + "_plain.png", *photographs.plain);
}

const char* const kSumsFile = "photographs.txt";

/// Returns a sum of the picture's gray levels, whatever file they came from: Fowler, Noll and Vo's,
/// 64 bits, in hex.
std::string sumOf(const calib::Picture& picture) {
  std::uint64_t sum = 14695981039346656037u;
  for (const std::uint8_t gray : picture.pixels) sum = (sum ^ gray) * 1099511628211u;
  return fmt::format("{:016x}", sum);
}

}  // namespace

void CalibrationFolder::make() const { makeFolder(path_); }

void CalibrationFolder::begin() const {
  const fs::path views = fs::path(path_) / "views";
  if (fs::exists(views) && !fs::is_empty(views)) {
    std::string old = path_ + "/views_" + dateNow();
    while (fs::exists(old)) old += "_";
    fs::rename(views, old);
  }
  makeFolder(views);
}

void CalibrationFolder::keep(const calib::Photographs& photographs) const {
  keepIn(fs::path(path_) / "views", photographs);
}

void CalibrationFolder::keepCamera(const calib::Lens& camera) const {
  calib::replaceFile(path_ + "/camera_info.yaml", calib::projectorYaml(camera, "camera"));
}

void CalibrationFolder::discard(const std::string& view) const {
  const std::string stem = path_ + "/views/" + view;
  fs::remove(stem + ".png");
  fs::remove(stem + "_plain.png");
}

void CalibrationFolder::save(const calib::Calibration& calibration,
                             const std::vector<calib::Photographs>& photographs,
                             const calib::ReportFacts& facts) const {
  const std::string date = dateNow();
  calib::saveCalibration(path_, calibration, facts.names, date);
  std::string sums;
  for (const calib::Photographs& one : photographs) sums += sumOf(one.pattern) + "\n";
  calib::replaceFile((fs::path(path_) / kSumsFile).string(), sums);
  std::vector<std::string> problems;
  const auto history = calib::calibrationHistory(path_, problems);
  calib::replaceFile(path_ + "/report.html",
                     calibrationPage(calibration, photographs, history, date, facts));
}

void CalibrationFolder::saveRefusal(const calib::CalibrationRefused& refused,
                                    const std::vector<calib::Photographs>& photographs) const {
  calib::replaceFile(path_ + "/report.html", refusalPage(refused, photographs, dateNow()));
}

bool CalibrationFolder::wasSolvedFrom(const calib::Picture& pattern) const {
  std::ifstream file(fs::path(path_) / kSumsFile);
  const std::string wanted = sumOf(pattern);
  for (std::string sum; std::getline(file, sum);) {
    if (sum == wanted) return true;
  }
  return false;
}

void CalibrationFolder::saveCheck(const calib::ErrorSummary& errors,
                                  const calib::Photographs& photographs) const {
  keepIn(fs::path(path_) / "check", photographs);
  calib::replaceFile(
      path_ + "/verification.yaml",
      fmt::format("# One view that had no part in the calibration: where the light should be, and "
                  "is.\ndate: {}\ncorners: {}\nrms_mm: {:g}\nmedian_mm: {:g}\np95_mm: {:g}\n"
                  "max_mm: {:g}\n",
                  dateNow(), errors.corners, errors.rms_mm, errors.median_mm, errors.p95_mm,
                  errors.max_mm));
}

}  // namespace afterglow::nodes
