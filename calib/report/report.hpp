/// \file
/// report.html: the evidence for a calibration, one file that opens without a network.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// What the page says beside the calibration itself; what is not known is not mentioned.
struct ReportFacts {
  CalibrationNames names;
  std::optional<Board> board;
  std::optional<Pattern> pattern;
};

/// The page's text. `photographs` match calibration.views by name; those missing have no picture.
/// `history` is what calibrationHistory gives, before or after this calibration was saved.
std::string reportPage(const Calibration& calibration, const std::vector<Photographs>& photographs,
                       const std::vector<CalibrationRecord>& history, const std::string& date,
                       const ReportFacts& facts = {});

/// The page for what was refused: reasons, advice, and each view's picture with what was seen.
std::string refusalPage(const CalibrationRefused& refused,
                        const std::vector<Photographs>& photographs, const std::string& date);

}  // namespace afterglow::calib
