#include <algorithm>
#include <cstdio>

#include "calib/number_text.hpp"
#include "calib/report/calibration_yaml.hpp"
#include "calib/report/certainty.hpp"
#include "calib/report/html.hpp"
#include "calib/report/sections.hpp"
#include "calib/report/view_facts.hpp"

namespace afterglow::calib {
namespace {

constexpr double kDriftDistance_m = 2;

/// Days since 1970 by the Gregorian calendar (Fliegel and Van Flandern, CACM 11(10), 1968), for the
/// drawing's time axis.
double days(const std::string& date) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0;
  if (std::sscanf(date.c_str(), "%d-%d-%dT%d:%d:%d", &year, &month, &day, &hour, &minute,
                  &second) != 6) {
    return 0;
  }
  const int a = (month - 14) / 12;
  const int julian = day - 32075 + 1461 * (year + 4800 + a) / 4 + 367 * (month - 2 - a * 12) / 12 -
                     3 * ((year + 4900 + a) / 100) / 4;
  return julian - 2440588 + (hour + (minute + second / 60.0) / 60.0) / 24.0;
}

/// "2026-11-21 04:30"
std::string shortDate(const std::string& date) {
  return isDate(date) ? date.substr(0, 10) + " " + date.substr(11, 5) : date;
}

std::vector<CalibrationRecord> withThis(const Calibration& calibration,
                                        std::vector<CalibrationRecord> history,
                                        const std::string& date) {
  if (!history.empty() && history.back().date == date) history.pop_back();  // saved already
  history.push_back({date, calibration.estimate, calibration.held_out_rms_px,
                     calibration.held_out_rms_mm, usedViews(calibration)});
  return history;
}

std::string historyRow(const CalibrationRecord& record, const CalibrationRecord* before) {
  std::string drift = numberCell("–") + numberCell("–") + numberCell("–");
  if (before != nullptr) {
    const auto moved = shiftBetween(before->estimate, record.estimate, kDriftDistance_m);
    drift = moved ? numberCell(fixedText(moved->rms_px, 2)) +
                        numberCell(fixedText(moved->rms_mm, 2)) +
                        numberCell(fixedText(moved->largest_mm, 2))
                  : element("td", "colspan=\"3\" class=\"soft\"", "another resolution");
  }
  return element("tr", element("td", escaped(shortDate(record.date))) +
                           numberCell(std::to_string(record.views_used)) +
                           numberCell(fixedText(record.held_out_rms_px, 3)) +
                           numberCell(fixedText(record.held_out_rms_mm, 3)) + drift) +
         "\n";
}

std::string historyTable(const std::vector<CalibrationRecord>& records) {
  const auto head = [](const std::string& text) { return element("th", "class=\"n\"", text); };
  std::string rows =
      element("thead",
              element("tr", element("th", "Date (UTC)") + head("Views") + head("Held out<br/>px") +
                                head("Held out<br/>mm") + head("Moved<br/>px") +
                                head("Moved<br/>mm at 2 m") + head("Moved at most<br/>mm at 2 m")));
  for (std::size_t i = 0; i < records.size(); ++i) {
    rows += historyRow(records[i], i > 0 ? &records[i - 1] : nullptr);
  }
  return element("table", rows);
}

struct Chart {
  static constexpr int kWidth = 520, kHeight = 230, kLeft = 46, kBottom = 34, kTop = 14,
                       kRight = 14;
  double first_day, last_day, top_mm;

  Eigen::Vector2d at(const CalibrationRecord& record) const {
    const double span = std::max(last_day - first_day, 1e-9);
    const double across = (days(record.date) - first_day) / span;
    return {kLeft + across * (kWidth - kLeft - kRight), height(record.held_out_rms_mm)};
  }
  double height(double mm) const {
    return kHeight - kBottom - mm / top_mm * (kHeight - kBottom - kTop);
  }
};

std::string label(double x, double y, const std::string& anchor, const std::string& text) {
  return element("text",
                 "x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\" text-anchor=\"" + anchor +
                     "\" font-size=\"11\" fill=\"#59636e\"",
                 text);
}

std::string axes(const Chart& chart, const std::vector<CalibrationRecord>& records) {
  std::string markup;
  const double step = roundDown(chart.top_mm / 2);
  for (int i = 0; i * step <= chart.top_mm * 1.0001; ++i) {
    const double y = chart.height(i * step);
    markup += "<path d=\"M" + point({Chart::kLeft, y}) + "H" +
              std::to_string(Chart::kWidth - Chart::kRight) +
              "\" stroke=\"#d5dbe1\" stroke-width=\"1\"/>" +
              label(Chart::kLeft - 8, y + 4, "end", exactText(i * step));
  }
  markup +=
      label(Chart::kLeft, Chart::kHeight - 8, "start", escaped(records.front().date.substr(0, 10)));
  return markup + label(Chart::kWidth - Chart::kRight, Chart::kHeight - 8, "end",
                        escaped(records.back().date.substr(0, 10)));
}

std::string historyChart(const std::vector<CalibrationRecord>& records) {
  double largest = 0;
  for (const CalibrationRecord& record : records) {
    largest = std::max(largest, record.held_out_rms_mm);
  }
  if (!(largest > 0)) largest = 1;
  const Chart chart{days(records.front().date), days(records.back().date), 1.15 * largest};
  std::string line, dots;
  for (const CalibrationRecord& record : records) {
    line += (line.empty() ? "M" : "L") + point(chart.at(record));
    dots += "M" + point(chart.at(record)) + "h0";
  }
  return element("figure", drawing(Chart::kWidth, Chart::kHeight, "Held-out error over time",
                                   axes(chart, records) + "<path d=\"" + line +
                                       "\" stroke=\"#0b5fa5\" stroke-width=\"1.8\"/><path d=\"" +
                                       dots + "\" stroke=\"#0b5fa5\" stroke-width=\"6\"/>") +
                               element("figcaption", "Held-out error in millimeters, over time."));
}

}  // namespace

std::string historySection(const Calibration& calibration,
                           const std::vector<CalibrationRecord>& history, const std::string& date) {
  const std::vector<CalibrationRecord> records = withThis(calibration, history, date);
  const std::string title = element("h2", "History");
  if (records.size() < 2) {
    return title + element("p", "This is the first calibration kept in this folder.") + "\n";
  }
  return title +
         element("p",
                 "Moved: how far the light for the same points, 2 m from the projector and "
                 "fixed to the camera, shifted from one calibration to the next (root mean "
                 "square over the picture). Much more than the held-out error means that "
                 "camera and projector moved against each other, or that zoom, focus or lens "
                 "shift were touched.") +
         "\n" + historyTable(records) + element("div", "class=\"two\"", historyChart(records)) +
         "\n";
}

}  // namespace afterglow::calib
