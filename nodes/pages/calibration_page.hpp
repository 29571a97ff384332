/// \file
/// report.html of a calibration: its evidence, or why there is none.
#pragma once

#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/report/report.hpp"

namespace afterglow::nodes {

/// `photographs` match calibration.views by name; those missing have no picture. `history` is what
/// calibrationHistory gives, before or after this calibration was saved.
std::string calibrationPage(const calib::Calibration& calibration,
                            const std::vector<calib::Photographs>& photographs,
                            const std::vector<calib::CalibrationRecord>& history,
                            const std::string& date, const calib::ReportFacts& facts = {});

/// The page for what was refused: reasons, advice, and each view's picture with what was seen.
std::string refusalPage(const calib::CalibrationRefused& refused,
                        const std::vector<calib::Photographs>& photographs,
                        const std::string& date);

}  // namespace afterglow::nodes
