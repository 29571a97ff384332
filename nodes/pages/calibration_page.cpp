#include "nodes/pages/calibration_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "calib/number_text.hpp"
#include "calib/report/calibration_files.hpp"
#include "nodes/pages/calibration_drawings.hpp"
#include "nodes/pages/drawing.hpp"
#include "nodes/pages/page_numbers.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

using calib::Calibration;
using calib::Photographs;
using calib::ViewResult;

// -------------------------------------------------------------------------------------- the views

int widthOf(const std::vector<Photographs>& photographs) {
  for (const Photographs& each : photographs) {
    if (each.pattern.width > 0) return each.pattern.width;
  }
  return 1280;
}

ResidualLines allLines(const std::vector<ViewResult>& views, bool with_left_out) {
  ResidualLines all;
  for (const ViewResult& view : views) {
    if (!view.is_used && !with_left_out) continue;
    const ResidualLines lines = photographLines(view);
    all.insert(all.end(), lines.begin(), lines.end());
  }
  return all;
}

/// Adds the photographs to `data`, which has the views already, with one magnification for all, so
/// that they can be compared.
void addPhotographs(const std::vector<ViewResult>& views,
                    const std::vector<Photographs>& photographs, double magnification,
                    PageData& data) {
  const ResidualLines all = allLines(views, true);
  data["magnification"] = magnification;
  data["has_errors"] = hasErrors(all);
  data["legend"] = residualLegend(all, "photo-");
  for (std::size_t i = 0; i < views.size(); ++i) {
    PageData& view = data["views"][i];
    view["index"] = i;
    view["drawing"] = photograph(views[i], photographs, magnification);
    const auto outliers = view.value("outliers", std::uint64_t(0));
    view["outlier_text"] = outliers > 0 ? replay::counted(outliers, "outlier") : "";
    view["is_seen"] = !views[i].residuals.empty();
  }
}

/// The length of each view's bars, in percent of the longest.
void addShares(PageData& views) {
  double largest = 0;
  const auto amount = [](const PageData& view, const char* key) {
    const auto found = view.find(key);
    return found == view.end() || found->is_null() ? 0 : found->get<double>();
  };
  for (const PageData& view : views) {
    largest = std::max({largest, amount(view, "held_out_px"), amount(view, "training_px")});
  }
  const double scale = largest > 0 ? 100 / largest : 0;
  for (PageData& view : views) {
    view["held_out_share"] = scale * amount(view, "held_out_px");
    view["training_share"] = scale * amount(view, "training_px");
  }
}

// --------------------------------------------------------------------------------------- the maps

void addCoverage(const Calibration& calibration, PageData& data) {
  data["coverage_figures"] = PageData::array(
      {figure("", coverageMap(calibration.coverage, calibration.estimate.projector),
              "Projected corners measured in each cell.", coverageLegend()),
       residualFigure(calibration)});
}

/// Null without a covariance.
PageData uncertaintyMaps(const Calibration& calibration) {
  if (calibration.estimate.covariance.isZero(0)) return nullptr;
  std::vector<calib::UncertaintyGrid> grids;
  for (const double distance : {1.0, 2.0, 3.0}) {
    grids.push_back(uncertaintyGrid(calibration.estimate, distance));
  }
  PageData units = PageData::array();
  for (const HeatUnit unit : {HeatUnit::kPixels, HeatUnit::kMillimeters}) {
    PageData figures = PageData::array();
    for (const calib::UncertaintyGrid& grid : grids) {
      figures.push_back(figure(
          fmt::format("At {:.0f} m, in {}", grid.distance_m,
                      unit == HeatUnit::kPixels ? "pixels" : "millimeters"),
          heatMap(grid, unit, calibration.coverage, calibration.estimate.projector), ""));
    }
    units.push_back({{"figures", figures}, {"scale", heatScale(unit)}});
  }
  return {{"units", units}, {"hatch", calibration.estimate.projector.width / 90.0}};
}

// ------------------------------------------------------------------------------------ the history

double secondsOf(const std::string& date) {
  std::tm parts{};
  if (strptime(date.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts) == nullptr) return 0;
  return static_cast<double>(timegm(&parts));
}

PageData historyPlot(const PageData& history) {
  const auto dateOf = [](const PageData& record) { return record["date"].get<std::string>(); };
  const double first = secondsOf(dateOf(history.front()));
  double largest = 0;
  replay::Samples errors;
  for (const PageData& record : history) {
    const auto mm = record["held_out_mm"].get<double>();
    errors.add({0, secondsOf(dateOf(record)) - first, mm});
    largest = std::max(largest, mm);
  }
  TimePlot plot(secondsOf(dateOf(history.back())) - first, 180, "Held-out error over time");
  plot.setLinear(0, largest > 0 ? 1.15 * largest : 1, "held out, mm");
  plot.setTimes(dateOf(history.front()).substr(0, 10), dateOf(history.back()).substr(0, 10));
  plot.line(errors, "held-out");
  plot.dots(errors, "held-out");
  return {{"drawing", plot.data()}, {"legend", PageData::array()}};
}

void addHistory(PageData& data) {
  PageData& history = data["history"];
  for (PageData& record : history) {
    const auto date = record["date"].get<std::string>();
    record["minute"] =
        calib::isDate(date) ? date.substr(0, 10) + " " + date.substr(11, 5) : date;
  }
  data["history_plot"] = history.size() > 1 ? historyPlot(history) : PageData();
}

// -------------------------------------------------------------------------------------- the pages

void addHead(const std::string& title, const std::string& before_date, const std::string& date,
             PageData& data) {
  data["page_title"] = title + ", " + date;
  data["title"] = title;
  data["under"] = before_date + date;
  data["tells_version"] = true;
}

/// Adds a notice of texts, or of views with reasons; empty items add nothing.
void addNotice(const std::string& heading, const PageData& items, bool is_bad, PageData& notices) {
  std::vector<NoticeItem> list;
  for (const PageData& item : items) {
    list.push_back(item.is_string()
                       ? NoticeItem{"", item.get<std::string>()}
                       : NoticeItem{item["name"].get<std::string>(),
                                    item["reason"].get<std::string>()});
  }
  if (!list.empty()) notices.push_back(notice(heading, list, is_bad));
}

/// Returns the views with the photographs that were not looked at before the calibration was
/// refused.
std::vector<ViewResult> withUnseen(std::vector<ViewResult> views,
                                   const std::vector<Photographs>& photographs) {
  for (const Photographs& each : photographs) {
    const bool is_known = std::any_of(
        views.begin(), views.end(), [&](const ViewResult& view) { return view.name == each.name; });
    if (is_known) continue;
    ViewResult view;
    view.name = each.name;
    views.push_back(view);
  }
  return views;
}

}  // namespace

std::string calibrationPage(const Calibration& calibration,
                            const std::vector<Photographs>& photographs,
                            const std::vector<calib::CalibrationRecord>& history,
                            const std::string& date, const calib::ReportFacts& facts) {
  PageData data = calib::reportData(calibration, history, date, facts);
  const calib::Lens& projector = calibration.estimate.projector;
  addHead("Projector calibration",
          fmt::format("{}, {} × {} px · ", facts.names.projector_name, projector.width,
                      projector.height),
          date, data);
  addNotice("Left out", data["left_out"], true, data["notices"]);
  addNotice("Be careful", data["warnings"], false, data["notices"]);
  addShares(data["views"]);
  addCoverage(calibration, data);
  data["board_figure"] = boardFigure(calibration.board_shape);
  data["uncertainty"] = uncertaintyMaps(calibration);
  addHistory(data);
  addPhotographs(calibration.views, photographs,
                 magnificationFor(allLines(calibration.views, false), widthOf(photographs)), data);
  return makePage("calibration.html", std::move(data));
}

std::string refusalPage(const calib::CalibrationRefused& refused,
                        const std::vector<Photographs>& photographs, const std::string& date) {
  const std::vector<ViewResult> views = withUnseen(refused.views(), photographs);
  PageData data;
  addHead("Calibration refused", "", date, data);
  addNotice("Why, and what to do", refused.reasons(), true, data["notices"]);
  data["views"] = PageData::array();
  for (const ViewResult& view : views) data["views"].push_back(viewData(view, {}));
  addPhotographs(views, photographs,
                 magnificationFor(allLines(views, true), widthOf(photographs)), data);
  return makePage("refusal.html", std::move(data));
}

}  // namespace afterglow::nodes
