/// \file
/// The folder of a calibration, live or from pictures: its pictures, its result, its report.
///
/// OUT/views/view_00.png, view_00_plain.png ... (what `afterglow calibrate solve --images` takes),
/// camera_info.yaml (the camera as given), saveCalibration's files, report.html, check/ (the
/// pictures of the check) and verification.yaml. Pictures of an earlier run are kept as
/// OUT/views_DATE. photographs.txt has the sums of the pictures that were solved from.
#pragma once

#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/landing.hpp"
#include "calib/picture.hpp"
#include "calib/report/report.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::nodes {

/// The folder of a calibration; every method throws std::runtime_error naming the path and why.
class CalibrationFolder {
 public:
  explicit CalibrationFolder(const std::string& path) : path_(path) {}

  /// Makes the folder, so that an impossible path is noticed early.
  void make() const;
  /// Begins a new set of views.
  void begin() const;
  void keep(const calib::Photographs& photographs) const;
  void keepCamera(const calib::Lens& camera) const;
  void discard(const std::string& view) const;
  void save(const calib::Calibration& calibration,
            const std::vector<calib::Photographs>& photographs,
            const calib::ReportFacts& facts) const;
  /// Writes the reasons to report.html; changes no other file.
  void saveRefusal(const calib::CalibrationRefused& refused,
                   const std::vector<calib::Photographs>& photographs) const;
  /// Returns true if the calibration was solved from this picture of the pattern, as far as the
  /// folder knows: older versions kept no sums.
  bool wasSolvedFrom(const calib::Picture& pattern) const;
  void saveCheck(const calib::ErrorSummary& errors, const calib::Photographs& photographs) const;

 private:
  std::string path_;
};

}  // namespace afterglow::nodes
