/// \file
/// The report's sections, each as markup. What a section has nothing to show for it says so.
#pragma once

#include <string>
#include <vector>

#include "calib/report/report.hpp"

namespace afterglow::calib {

/// The held-out error, large; what it means; what was left out and what to be careful about.
std::string headlineSection(const Calibration& calibration);
std::string viewTableSection(const Calibration& calibration);
/// Every view's photograph with its residuals drawn on it.
std::string viewPictureSection(const Calibration& calibration,
                               const std::vector<Photographs>& photographs);
/// Which of the projector's pixels were measured, and what error was left there.
std::string coverageSection(const Calibration& calibration);
/// Predicted uncertainty over the projector's picture at 1, 2 and 3 m.
std::string uncertaintySection(const Calibration& calibration);
std::string parameterSection(const Calibration& calibration);
std::string historySection(const Calibration& calibration,
                           const std::vector<CalibrationRecord>& history, const std::string& date);
/// Date, version, camera, board, pattern: how this calibration came about.
std::string factsSection(const Calibration& calibration, const std::string& date,
                         const ReportFacts& facts);

/// The photographs of refused views with what was seen in them.
std::string refusedViewSection(const std::vector<ViewResult>& views,
                               const std::vector<Photographs>& photographs);

}  // namespace afterglow::calib
