#include "nodes/pages/calibration_page.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>

#include "calib/number_text.hpp"
#include "calib/report/calibration_files.hpp"
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

namespace {

using calib::Coverage;
using calib::Lens;
using calib::UncertaintyGrid;

/// A cell with so many corners or more looks "count-1" and so on; "count-0" has none.
constexpr std::array<int, 4> kCounts{1, 4, 10, 30};

/// "heat-0" and so on: amounts below each. The first of the dark colors.
constexpr std::array<double, 10> kHeatLimits{0.005, 0.01, 0.02, 0.05, 0.1,
                                             0.2,   0.5,  1,    2,    HUGE_VAL};
constexpr std::size_t kFirstDark = 5;

/// Enough to tell the tags apart on half a page; a tenth of a megabyte a view.
constexpr int kWidestPhotograph = 800;

struct Cell {
  double x, y, width, height;
  int count;
};

std::vector<Cell> cellsOf(const Coverage& coverage, const Lens& projector) {
  const double width = double(projector.width) / Coverage::kColumns;
  const double height = double(projector.height) / Coverage::kRows;
  std::vector<Cell> cells;
  for (int i = 0; i < Coverage::kColumns * Coverage::kRows; ++i) {
    cells.push_back({i % Coverage::kColumns * width - 0.5, i / Coverage::kColumns * height - 0.5,
                     width, height, coverage.corners.at(static_cast<std::size_t>(i))});
  }
  return cells;
}

std::size_t countLook(int count) {
  return static_cast<std::size_t>(std::upper_bound(kCounts.begin(), kCounts.end(), count) -
                                  kCounts.begin());
}

double amount(const calib::Uncertainty& uncertainty, HeatUnit unit) {
  return unit == HeatUnit::kPixels ? uncertainty.px : uncertainty.mm;
}

/// Index into kHeatLimits, or their number where no light gets to.
std::size_t heatOf(const std::optional<calib::Uncertainty>& uncertainty, HeatUnit unit) {
  if (!uncertainty) return kHeatLimits.size();
  return static_cast<std::size_t>(std::upper_bound(kHeatLimits.begin(), kHeatLimits.end() - 1,
                                                   amount(*uncertainty, unit)) -
                                  kHeatLimits.begin());
}

/// Cells of one color in a row become one box.
void drawHeat(const UncertaintyGrid& grid, HeatUnit unit, Drawing& drawing) {
  for (int row = 0; row < grid.rows; ++row) {
    for (int from = 0, to = 0; from < grid.columns; from = to) {
      const std::size_t heat = heatOf(grid.at(from, row), unit);
      while (to < grid.columns && heatOf(grid.at(to, row), unit) == heat) ++to;
      drawing.box(heat < kHeatLimits.size() ? "heat heat-" + std::to_string(heat) : "heat unlit",
                  from * grid.cell_px.x() - 0.5, row * grid.cell_px.y() - 0.5,
                  (to - from) * grid.cell_px.x(), grid.cell_px.y());
    }
  }
}

void writeAmounts(const UncertaintyGrid& grid, HeatUnit unit, Drawing& drawing) {
  constexpr int kAcross = 5, kDown = 5;
  for (int i = 0; i < kAcross * kDown; ++i) {
    const int column = grid.columns * (2 * (i % kAcross) + 1) / (2 * kAcross);
    const int row = grid.rows * (2 * (i / kAcross) + 1) / (2 * kDown);
    const auto& uncertainty = grid.at(column, row);
    if (!uncertainty) continue;
    drawing.text(heatOf(uncertainty, unit) < kFirstDark ? "on-light" : "on-dark",
                 (column + 0.5) * grid.cell_px.x() - 0.5, (row + 0.5) * grid.cell_px.y() - 0.5,
                 twoDigits(amount(*uncertainty, unit)));
  }
}

/// The board's heights over its best plane, as colors or, `is_written`, as numbers: amounts in
/// millimeters have one look on all pages.
void drawHeights(const calib::BoardShape& shape, bool is_written, Drawing& drawing) {
  constexpr int kAcross = 25, kDown = 15, kWrittenEach = 5;
  const Eigen::Vector2d cells(kAcross, kDown);
  const Eigen::Vector2d cell_mm = 2000 * shape.half_m.cwiseQuotient(cells);
  const Eigen::Vector3d plane = shape.plane();
  for (int i = 0; i < kAcross * kDown; ++i) {
    const int column = i % kAcross, row = i / kAcross;
    const Eigen::Vector2d from_mm(column * cell_mm.x() - 0.5, row * cell_mm.y() - 0.5);
    const Eigen::Vector2d middle_mm = from_mm + cell_mm / 2;
    const Eigen::Vector2d at(1e-3 * (middle_mm.x() + 0.5) - shape.half_m.x(),
                             shape.half_m.y() - 1e-3 * (middle_mm.y() + 0.5));
    const double mm = 1000 * (shape.height(at) - plane.dot(at.homogeneous()));
    const std::size_t heat = heatOf(calib::Uncertainty{0, std::abs(mm)}, HeatUnit::kMillimeters);
    if (!is_written) {
      drawing.box("heat heat-" + std::to_string(heat), from_mm.x(), from_mm.y(), cell_mm.x(),
                  cell_mm.y());
    } else if (column % kWrittenEach == 2 && row % kWrittenEach == 2) {
      drawing.text(heat < kFirstDark ? "on-light" : "on-dark", middle_mm.x(), middle_mm.y(),
                   (mm < 0 ? "−" : "+") + calib::fixedText(std::abs(mm), 2));
    }
  }
}

/// The part of a picture that is shown.
struct Part {
  int left = 0, top = 0, width = 0, height = 0;
};

/// The board with a margin of a fifth of its size, in the picture's own shape.
Part shownPart(const calib::ViewResult& view, const calib::Picture& picture) {
  constexpr double kMargin = 0.2;
  const Part whole{0, 0, picture.width, picture.height};
  Eigen::AlignedBox2d corners;
  for (const calib::CornerResidual& corner : view.residuals) {
    if (corner.camera_px.allFinite()) corners.extend(corner.camera_px);
  }
  if (corners.isEmpty()) return whole;
  const double shape = double(picture.width) / picture.height;
  const double across = std::max(corners.sizes().x(), shape * corners.sizes().y());
  const double width = (1 + 2 * kMargin) * std::max(across, picture.width / 6.0);
  if (!(width < picture.width)) return whole;
  const Eigen::Vector2d middle = corners.center();
  Part part;
  part.width = std::max(1, static_cast<int>(width));
  part.height = std::clamp(static_cast<int>(width / shape), 1, picture.height);
  part.left =
      static_cast<int>(std::clamp(middle.x() - width / 2, 0.0, double(picture.width - part.width)));
  part.top = static_cast<int>(
      std::clamp(middle.y() - part.height / 2.0, 0.0, double(picture.height - part.height)));
  return part;
}

calib::Picture cut(const calib::Picture& picture, const Part& part) {
  calib::Picture result;
  result.width = part.width;
  result.height = part.height;
  for (int y = part.top; y < part.top + part.height; ++y) {
    const auto row = picture.pixels.begin() + static_cast<std::ptrdiff_t>(y) * picture.width;
    result.pixels.insert(result.pixels.end(), row + part.left, row + part.left + part.width);
  }
  return result;
}

}  // namespace

PageData coverageMap(const Coverage& coverage, const Lens& projector) {
  Drawing drawing("map", projector.width, projector.height, projector.width / 45.0,
                  "Corners measured in each cell");
  for (const Cell& cell : cellsOf(coverage, projector)) {
    const std::size_t look = countLook(cell.count);
    drawing.box("cell count-" + std::to_string(look), cell.x, cell.y, cell.width, cell.height);
    drawing.text(look == 0 ? "none" : "number", cell.x + cell.width / 2, cell.y + cell.height / 2,
                 std::to_string(cell.count));
  }
  return drawing.data();
}

PageData coverageLegend() {
  PageData legend = PageData::array({legendEntry("count-0", "none")});
  for (std::size_t i = 0; i < kCounts.size(); ++i) {
    const std::string from = std::to_string(kCounts[i]);
    legend.push_back(legendEntry("count-" + std::to_string(i + 1),
                                 i + 1 < kCounts.size()
                                     ? from + "–" + std::to_string(kCounts[i + 1] - 1)
                                     : from + " or more"));
  }
  return legend;
}

PageData heatMap(const UncertaintyGrid& grid, HeatUnit unit, const Coverage& coverage,
                 const Lens& projector) {
  Drawing drawing("map", projector.width, projector.height, projector.width / 27.0,
                  std::string("95 % uncertainty in ") +
                      (unit == HeatUnit::kPixels ? "px" : "mm") + " at " +
                      calib::fixedText(grid.distance_m, 0) + " m");
  drawHeat(grid, unit, drawing);
  for (const Cell& cell : cellsOf(coverage, projector)) {
    if (cell.count == 0) drawing.box("unmeasured", cell.x, cell.y, cell.width, cell.height);
  }
  writeAmounts(grid, unit, drawing);
  return drawing.data();
}

PageData heatScale(HeatUnit unit) {
  PageData scale = PageData::array();
  for (std::size_t i = 0; i < kHeatLimits.size(); ++i) {
    scale.push_back({{"look", "heat-" + std::to_string(i)}, {"limit", nullptr}});
    if (!std::isfinite(kHeatLimits[i])) continue;
    scale.back()["limit"] =
        calib::exactText(kHeatLimits[i]) + (unit == HeatUnit::kPixels ? " px" : " mm");
  }
  return scale;
}

PageData boardFigure(const calib::BoardShape& shape) {
  const std::string text = shapeText(shape);
  if (text.empty()) return nullptr;
  const Eigen::Vector2d size_mm = 2000 * shape.half_m;
  Drawing drawing("map", size_mm.x(), size_mm.y(), size_mm.x() / 32, "The board " + text);
  drawHeights(shape, false, drawing);
  drawHeights(shape, true, drawing);
  return figure("", drawing.data(),
                "The board " + text + ": millimeters above its mean plane, seen from its face.");
}

PageData residualFigure(const calib::Calibration& calibration) {
  const Lens& projector = calibration.estimate.projector;
  const ResidualLines lines = projectorLines(calibration);
  const double magnification = magnificationFor(lines, projector.width);
  Drawing drawing("map", projector.width, projector.height, projector.width / 45.0,
                  "Residuals over the projector’s picture");
  drawOnMap(lines, magnification, projector.width, drawing);
  return figure("", drawing.data(),
                "Every projected corner (dot) with what the calibration leaves unexplained: seen "
                "minus expected, magnified " +
                    calib::fixedText(magnification, 0) +
                    " times. Lines that agree with their neighbors mean that the lens model "
                    "misses something; lines in all directions are noise. Outliers are red and "
                    "cut short.",
                residualLegend(lines, ""));
}

PageData photograph(const calib::ViewResult& view,
                    const std::vector<calib::Photographs>& photographs, double magnification) {
  const auto found =
      std::find_if(photographs.begin(), photographs.end(),
                   [&](const calib::Photographs& each) { return each.name == view.name; });
  if (found == photographs.end() || found->pattern.pixels.empty()) return nullptr;
  const Part part = shownPart(view, found->pattern);
  Drawing drawing("photograph", part.width, part.height, 0.026 * part.width,
                  "Photograph of " + view.name);
  drawing.image(imageUri(cut(found->pattern, part), kWidestPhotograph));
  const ResidualLines lines = photographLines(view, Eigen::Vector2d(part.left, part.top));
  drawOnPhotograph(lines, magnification, part.width, part.height, drawing);
  return drawing.data();
}

namespace {

/// The looks in the order they are drawn.
constexpr const char* kLooks[] = {"printed", "projected", "outlier"};
constexpr const char* kMeanings[] = {"printed corner", "projected corner", "outlier"};

/// Longer lines than this share of the picture's width are cut: they would cross everything.
constexpr double kLongest = 0.08;

void add(const ResidualLine& line, ResidualLines& lines) {
  if (line.at.allFinite() && line.error.allFinite()) lines.push_back(line);
}

std::string linesOf(const ResidualLines& lines, const std::string& look, double magnification,
                    double longest) {
  std::string d;
  for (const ResidualLine& line : lines) {
    if (line.look != look) continue;
    Eigen::Vector2d drawn = line.error * magnification;
    if (drawn.norm() > longest) drawn *= longest / drawn.norm();
    d += "M" + point(line.at) + "l" + point(drawn);
  }
  return d;
}

std::string dotsOf(const ResidualLines& lines, const std::string& look) {
  std::string d;
  for (const ResidualLine& line : lines) {
    if (line.look == look) d += dotAt(line.at);
  }
  return d;
}

void draw(const ResidualLines& lines, double magnification, int width, const std::string& more,
          Drawing& drawing) {
  for (const std::string look : kLooks) {
    drawing.path("line " + look + more,
                 linesOf(lines, look, magnification, kLongest * width));
    drawing.path("dots " + look + more, dotsOf(lines, look));
  }
}

void drawOutlierRings(const ResidualLines& lines, int width, Drawing& drawing) {
  for (const ResidualLine& line : lines) {
    if (line.look == "outlier") drawing.ring("outlier", line.at, width / 110.0, line.remark);
  }
}

void drawLengthBar(double magnification, int width, int height, Drawing& drawing) {
  const double bar_px = roundDown(width / 8.0 / magnification);
  const double left = 0.03 * width, bottom = height - 0.04 * width;
  const std::string bar = "M" + point({left, bottom}) + "h" + coordinate(bar_px * magnification);
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(bar_px) + 1e-9)));
  drawing.path("length halo", bar);
  drawing.path("length", bar);
  drawing.text("", left, bottom - 0.012 * width, calib::fixedText(bar_px, decimals) + " px");
}

/// The error that nine of ten do not exceed; 0 if there are none.
double typicalOf(std::vector<double> errors) {
  if (errors.empty()) return 0;
  const auto at = std::min(errors.size() - 1, errors.size() * 9 / 10);
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(at), errors.end());
  return errors[at];
}

}  // namespace

ResidualLines photographLines(const calib::ViewResult& view, const Eigen::Vector2d& origin) {
  ResidualLines lines;
  for (const calib::CornerResidual& corner : view.residuals) {
    const std::string look = corner.is_projected ? "projected" : "printed";
    add({corner.camera_px - origin, corner.error_px, corner.is_outlier ? "outlier" : look,
         fmt::format("{} tag {}, corner {}: {:.2f} px", look, corner.tag_id, corner.corner,
                     corner.error_px.norm())},
        lines);
  }
  return lines;
}

ResidualLines projectorLines(const calib::Calibration& calibration) {
  ResidualLines lines;
  for (const calib::ViewResult& view : calibration.views) {
    if (!view.is_used) continue;
    for (const calib::CornerResidual& corner : view.residuals) {
      if (!corner.is_projected) continue;
      add({corner.pattern_px, corner.pattern_error_px,
           corner.is_outlier ? "outlier" : "projected",
           fmt::format("{}, tag {}: {:.2f} px", view.name, corner.tag_id,
                       corner.pattern_error_px.norm())},
          lines);
    }
  }
  return lines;
}

double magnificationFor(const ResidualLines& lines, int picture_width) {
  std::vector<double> lengths;
  for (const ResidualLine& line : lines) {
    if (line.look != "outlier") lengths.push_back(line.error.norm());
  }
  const double typical = typicalOf(std::move(lengths));
  if (!(typical > 0)) return 1;
  return std::clamp(roundDown(picture_width / 40.0 / typical), 1.0, 10000.0);
}

bool hasErrors(const ResidualLines& lines) {
  return std::any_of(lines.begin(), lines.end(),
                     [](const ResidualLine& line) { return !line.error.isZero(0); });
}

void drawOnPhotograph(const ResidualLines& lines, double magnification, int width, int height,
                      Drawing& drawing) {
  draw(lines, magnification, width, " halo", drawing);
  draw(lines, magnification, width, "", drawing);
  drawOutlierRings(lines, width, drawing);
  if (hasErrors(lines)) drawLengthBar(magnification, width, height, drawing);
}

void drawOnMap(const ResidualLines& lines, double magnification, int width, Drawing& drawing) {
  draw(lines, magnification, width, "", drawing);
  drawOutlierRings(lines, width, drawing);
}

PageData residualLegend(const ResidualLines& lines, const std::string& before_look) {
  PageData legend = PageData::array();
  for (std::size_t i = 0; i < std::size(kLooks); ++i) {
    const bool is_there = std::any_of(lines.begin(), lines.end(), [&](const ResidualLine& line) {
      return line.look == kLooks[i];
    });
    if (is_there) legend.push_back(legendEntry("line " + before_look + kLooks[i], kMeanings[i]));
  }
  return legend;
}

}  // namespace afterglow::nodes
