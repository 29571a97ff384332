#include "nodes/pages/calibration_drawings.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "calib/number_text.hpp"

namespace afterglow::nodes {
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
