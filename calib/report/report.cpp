#include "calib/report/report.hpp"

#include "calib/number_text.hpp"
#include "calib/report/html.hpp"
#include "calib/report/sections.hpp"

namespace afterglow::calib {
namespace {

std::string size(int width, int height) {
  return std::to_string(width) + " × " + std::to_string(height) + " px";
}

std::string lensText(const Lens& lens) {
  std::string text = size(lens.width, lens.height) + "; fx " + fixedText(lens.K(0, 0), 2) +
                     ", fy " + fixedText(lens.K(1, 1), 2) + ", cx " + fixedText(lens.K(0, 2), 2) +
                     ", cy " + fixedText(lens.K(1, 2), 2) + " px; " +
                     (lens.model == LensModel::Equidistant ? "equidistant " : "") + "distortion";
  std::size_t terms = lens.D.size();
  while (terms > 0 && lens.D[terms - 1] == 0) --terms;
  if (terms == 0) text += " none";
  for (std::size_t i = 0; i < terms; ++i) {
    text += (i > 0 ? ", " : " ") + fixedText(lens.D[i], 5);
  }
  return text;
}

std::string boardText(const Board& board) {
  std::string text = fixedText(1000 * board.size_m.x(), 0) + " × " +
                     fixedText(1000 * board.size_m.y(), 0) + " mm, " +
                     std::to_string(board.tags.size()) + " tags " + board.family;
  if (!board.tags.empty()) {
    const Tag& tag = board.tags.front();
    text += " of " + fixedText(1000 * (tag.corners[1] - tag.corners[0]).norm(), 1) + " mm";
  }
  return text;
}

std::string patternText(const Pattern& pattern) {
  return size(pattern.width, pattern.height) + ", " + std::to_string(pattern.tags.size()) +
         " tags " + pattern.family;
}

std::string factRow(const std::string& name, const std::string& value) {
  return element("tr", element("td", name) + element("td", escaped(value))) + "\n";
}

std::string under(const Calibration& calibration, const std::string& date,
                  const ReportFacts& facts) {
  const Lens& projector = calibration.estimate.projector;
  return element("p", "class=\"under\"",
                 escaped(facts.names.projector_name) + ", " +
                     size(projector.width, projector.height) + " · " + escaped(date) +
                     " · afterglow " AFTERGLOW_VERSION);
}

}  // namespace

std::string factsSection(const Calibration& calibration, const std::string& date,
                         const ReportFacts& facts) {
  std::string rows =
      factRow("Solved", date + ", by afterglow " AFTERGLOW_VERSION) +
      factRow("Frames", facts.names.camera_frame + " → " + facts.names.projector_frame) +
      factRow("Camera", lensText(calibration.camera)) +
      factRow("Projector", lensText(calibration.estimate.projector));
  if (calibration.camera_info.width > 0) {
    rows += factRow("Its camera_info", lensText(calibration.camera_info) + "; " +
                                           cameraText(calibration.camera_change));
  }
  if (facts.board) rows += factRow("Board", boardText(*facts.board));
  if (facts.pattern) rows += factRow("Pattern", patternText(*facts.pattern));
  return element("h2", "How this was made") + element("table", "class=\"narrow\"", rows) + "\n";
}

std::string reportPage(const Calibration& calibration, const std::vector<Photographs>& photographs,
                       const std::vector<CalibrationRecord>& history, const std::string& date,
                       const ReportFacts& facts) {
  return page("Projector calibration, " + date,
              element("h1", "Projector calibration") + under(calibration, date, facts) + "\n" +
                  headlineSection(calibration) + viewTableSection(calibration) +
                  coverageSection(calibration) + uncertaintySection(calibration) +
                  parameterSection(calibration) + historySection(calibration, history, date) +
                  viewPictureSection(calibration, photographs) +
                  factsSection(calibration, date, facts));
}

std::string refusalPage(const CalibrationRefused& refused,
                        const std::vector<Photographs>& photographs, const std::string& date) {
  std::string reasons;
  for (const std::string& reason : refused.reasons()) reasons += element("li", escaped(reason));
  return page(
      "Calibration refused, " + date,
      element("h1", "Calibration refused") +
          element("p", "class=\"under\"", escaped(date) + " · afterglow " AFTERGLOW_VERSION) +
          element("div", "class=\"note bad\"",
                  element("h3", "Why, and what to do") + element("ul", reasons)) +
          element("p", "No calibration was written; one from before is unchanged.") + "\n" +
          refusedViewSection(refused.views(), photographs));
}

}  // namespace afterglow::calib
