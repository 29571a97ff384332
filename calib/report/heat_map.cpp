#include "calib/report/heat_map.hpp"

#include <array>
#include <cmath>

#include "calib/number_text.hpp"
#include "calib/report/html.hpp"
#include "calib/report/sections.hpp"

namespace afterglow::calib {
namespace {

/// Each color is for amounts below `limit`. The colors are ten even steps of matplotlib's viridis
/// (CC0), which grows evenly darker, for the color-blind and in grey print too.
struct Step {
  double limit;
  const char* color;
  bool is_dark;
};
constexpr std::array<Step, 10> kSteps{{{0.005, "#fde725", false},
                                       {0.01, "#b5de2b", false},
                                       {0.02, "#6ece58", false},
                                       {0.05, "#35b779", false},
                                       {0.1, "#1f9e89", false},
                                       {0.2, "#26828e", true},
                                       {0.5, "#31688e", true},
                                       {1, "#3e4989", true},
                                       {2, "#482878", true},
                                       {HUGE_VAL, "#440154", true}}};
constexpr const char* kUnlit = "#e3e6ea";

/// A multiple of the coverage's cells, so that hatching and colors share their edges.
constexpr int kColumns = 4 * Coverage::kColumns, kRows = 4 * Coverage::kRows;

double amount(const Uncertainty& uncertainty, HeatUnit unit) {
  return unit == HeatUnit::kPixels ? uncertainty.px : uncertainty.mm;
}

/// Index into kSteps, or kSteps.size() where no light gets to.
std::size_t stepOf(const std::optional<Uncertainty>& uncertainty, HeatUnit unit) {
  if (!uncertainty) return kSteps.size();
  std::size_t step = 0;
  while (amount(*uncertainty, unit) >= kSteps[step].limit) ++step;
  return step;
}

std::string rectangle(double x, double y, double width, double height, const std::string& fill) {
  return "<rect x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\" width=\"" +
         coordinate(width) + "\" height=\"" + coordinate(height) + "\" fill=\"" + fill + "\"/>";
}

/// Cells of one color in a row become one rectangle.
std::string colors(const UncertaintyGrid& grid, HeatUnit unit) {
  std::string markup;
  for (int row = 0; row < grid.rows; ++row) {
    for (int from = 0, to = 0; from < grid.columns; from = to) {
      const std::size_t step = stepOf(grid.at(from, row), unit);
      while (to < grid.columns && stepOf(grid.at(to, row), unit) == step) ++to;
      markup += rectangle(from * grid.cell_px.x() - 0.5, row * grid.cell_px.y() - 0.5,
                          (to - from) * grid.cell_px.x(), grid.cell_px.y(),
                          step < kSteps.size() ? kSteps[step].color : kUnlit);
    }
  }
  return element("g", "shape-rendering=\"crispEdges\"", markup);
}

/// Beside a white one a black one, to be seen on any color.
std::string stripe(double x, double width, double height, const std::string& color) {
  return "<rect x=\"" + coordinate(x) + "\" width=\"" + coordinate(width) + "\" height=\"" +
         coordinate(height) + "\" fill=\"" + color + "\" fill-opacity=\"0.5\"/>";
}

/// Ids in a page are unique; a drawing's pattern is therefore named after what it shows.
std::string hatching(const Coverage& coverage, const Lens& projector, const std::string& id) {
  const double width = double(projector.width) / Coverage::kColumns;
  const double height = double(projector.height) / Coverage::kRows;
  const double step = projector.width / 90.0;
  std::string markup = element(
      "defs",
      element("pattern",
              "id=\"" + id + "\" patternUnits=\"userSpaceOnUse\" width=\"" + coordinate(step) +
                  "\" height=\"" + coordinate(step) + "\" patternTransform=\"rotate(45)\"",
              stripe(0, 0.3 * step, step, "#fff") + stripe(0.3 * step, 0.18 * step, step, "#000")));
  for (int row = 0; row < Coverage::kRows; ++row) {
    for (int column = 0; column < Coverage::kColumns; ++column) {
      const auto index = static_cast<std::size_t>(row * Coverage::kColumns + column);
      if (coverage.corners.at(index) > 0) continue;
      markup +=
          rectangle(column * width - 0.5, row * height - 0.5, width, height, "url(#" + id + ")");
    }
  }
  return markup;
}

std::string numbers(const UncertaintyGrid& grid, HeatUnit unit, const Lens& projector) {
  constexpr int kAcross = 5, kDown = 5;
  const double size = projector.width / 27.0;
  std::string markup;
  for (int i = 0; i < kAcross * kDown; ++i) {
    const int column = grid.columns * (2 * (i % kAcross) + 1) / (2 * kAcross);
    const int row = grid.rows * (2 * (i / kAcross) + 1) / (2 * kDown);
    const auto& uncertainty = grid.at(column, row);
    if (!uncertainty) continue;
    const bool is_dark = kSteps[stepOf(uncertainty, unit)].is_dark;
    markup += element("text",
                      "x=\"" + coordinate((column + 0.5) * grid.cell_px.x() - 0.5) + "\" y=\"" +
                          coordinate((row + 0.5) * grid.cell_px.y() - 0.5 + 0.35 * size) +
                          "\" fill=\"" + (is_dark ? "#fff" : "#10161d") + "\" stroke=\"" +
                          (is_dark ? "#1d1147" : "#fff") + "\"",
                      twoDigits(amount(*uncertainty, unit)));
  }
  return element("g",
                 "text-anchor=\"middle\" font-size=\"" + coordinate(size) +
                     "\" font-weight=\"600\" paint-order=\"stroke\" stroke-opacity=\"0.55\" "
                     "stroke-width=\"" +
                     coordinate(size / 5) + "\"",
                 markup);
}

std::string figure(const UncertaintyGrid& grid, HeatUnit unit, const Calibration& calibration) {
  const std::string what = unit == HeatUnit::kPixels ? "pixels" : "millimeters";
  return element("figure",
                 element("h3", "At " + fixedText(grid.distance_m, 0) + " m, in " + what) +
                     heatMap(grid, unit, calibration.coverage, calibration.estimate.projector)) +
         "\n";
}

}  // namespace

UncertaintyGrid uncertaintyGrid(const ProjectorEstimate& estimate, double distance_m) {
  UncertaintyGrid grid;
  grid.columns = kColumns;
  grid.rows = kRows;
  grid.distance_m = distance_m;
  grid.cell_px = Eigen::Vector2d(double(estimate.projector.width) / kColumns,
                                 double(estimate.projector.height) / kRows);
  for (int i = 0; i < kColumns * kRows; ++i) {
    const Eigen::Vector2d center(i % kColumns + 0.5, i / kColumns + 0.5);
    grid.cells.push_back(uncertaintyAt(
        estimate, grid.cell_px.cwiseProduct(center) - Eigen::Vector2d(0.5, 0.5), distance_m));
  }
  return grid;
}

std::string heatMap(const UncertaintyGrid& grid, HeatUnit unit, const Coverage& coverage,
                    const Lens& projector) {
  const std::string name = unit == HeatUnit::kPixels ? "px" : "mm";
  const std::string distance = fixedText(grid.distance_m, 0);
  return drawing(
      projector.width, projector.height, "95 % uncertainty in " + name + " at " + distance + " m",
      colors(grid, unit) + hatching(coverage, projector, "hatch-" + name + "-" + distance) +
          numbers(grid, unit, projector));
}

std::string heatLegend(HeatUnit unit) {
  const std::string name = unit == HeatUnit::kPixels ? " px" : " mm";
  std::string markup;
  for (const Step& step : kSteps) {
    const std::string limit =
        std::isfinite(step.limit) ? element("b", exactText(step.limit) + name) : "";
    markup += element(
        "div", limit + element("i", std::string("style=\"background:") + step.color + "\"", ""));
  }
  return element("div", "class=\"scale\"", markup);
}

std::string uncertaintySection(const Calibration& calibration) {
  std::vector<UncertaintyGrid> grids;
  for (const double distance : {1.0, 2.0, 3.0}) {
    grids.push_back(uncertaintyGrid(calibration.estimate, distance));
  }
  std::string text = element("h2", "Predicted uncertainty over the projector’s picture");
  if (calibration.estimate.covariance.isZero(0)) {
    return text + element("p", "This calibration has no covariance: nothing can be predicted.");
  }
  text += element(
      "p",
      "In 95 % of calibrations as good as this one, light meant for a point lands within this "
      "radius of it (the longest half-axis of the 95 % ellipse), by the calibration’s covariance "
      "alone: errors of the camera’s own calibration and of tf come on top. The held-out error at "
      "the top is measured only where boards were held, and contains the noise of the corners it "
      "is measured with. Millimeters are on a surface facing the projector at that distance. In "
      "the hatched cells nothing was measured: the numbers there extrapolate, and hold only as far "
      "as the lens model does.");
  for (const HeatUnit unit : {HeatUnit::kPixels, HeatUnit::kMillimeters}) {
    std::string figures;
    for (const UncertaintyGrid& grid : grids) figures += figure(grid, unit, calibration);
    text += element("div", "class=\"three\"", figures) + heatLegend(unit) + "\n";
  }
  return text;
}

}  // namespace afterglow::calib
