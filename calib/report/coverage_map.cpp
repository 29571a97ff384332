#include <algorithm>
#include <array>

#include "calib/number_text.hpp"
#include "calib/report/html.hpp"
#include "calib/report/residual_lines.hpp"
#include "calib/report/sections.hpp"

namespace afterglow::calib {
namespace {

struct Shade {
  int from;
  const char* color;
};
constexpr std::array<Shade, 4> kShades{
    {{1, "#dcebf7"}, {4, "#b5d3ec"}, {10, "#82b3dd"}, {30, "#4a8fca"}}};
constexpr const char* kEmpty = "#f6bcc4";

const char* shadeOf(int count) {
  const char* color = kEmpty;
  for (const Shade& shade : kShades) {
    if (count >= shade.from) color = shade.color;
  }
  return color;
}

std::string cellMarkup(double x, double y, double width, double height, int count) {
  std::string markup = "<rect x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\" width=\"" +
                       coordinate(width) + "\" height=\"" + coordinate(height) + "\" fill=\"" +
                       shadeOf(count) + "\" stroke=\"#fff\"/>";
  const std::string color = count == 0 ? "#a00020" : count >= 30 ? "#fff" : "#26415a";
  return markup + element("text",
                          "x=\"" + coordinate(x + width / 2) + "\" y=\"" +
                              coordinate(y + height / 2 + 0.13 * width) +
                              "\" text-anchor=\"middle\" font-size=\"" + coordinate(0.36 * width) +
                              "\" fill=\"" + color + "\"",
                          std::to_string(count));
}

std::string countMap(const Coverage& coverage, const Lens& projector) {
  const double width = double(projector.width) / Coverage::kColumns;
  const double height = double(projector.height) / Coverage::kRows;
  std::string cells;
  for (int row = 0; row < Coverage::kRows; ++row) {
    for (int column = 0; column < Coverage::kColumns; ++column) {
      const auto index = static_cast<std::size_t>(row * Coverage::kColumns + column);
      cells += cellMarkup(column * width - 0.5, row * height - 0.5, width, height,
                          coverage.corners.at(index));
    }
    cells += "\n";
  }
  return drawing(projector.width, projector.height, "Corners measured in each cell", cells);
}

std::string swatch(const std::string& color, const std::string& text) {
  return element("span", element("i", "style=\"background:" + color + "\"", "") + text);
}

std::string countLegend() {
  std::string markup = swatch(kEmpty, "none");
  for (std::size_t i = 0; i < kShades.size(); ++i) {
    const std::string from = std::to_string(kShades[i].from);
    markup += swatch(kShades[i].color, i + 1 < kShades.size()
                                           ? from + "–" + std::to_string(kShades[i + 1].from - 1)
                                           : from + " or more");
  }
  return element("div", "class=\"legend\"", markup);
}

/// Residuals in the projector's pixels, of the used views.
ResidualLines projectorResiduals(const Calibration& calibration) {
  ResidualLines lines;
  for (const ViewResult& view : calibration.views) {
    if (!view.is_used) continue;
    for (const CornerResidual& corner : view.residuals) {
      if (!corner.is_projected) continue;
      lines.add({corner.pattern_px, corner.pattern_error_px,
                 corner.is_outlier ? LineKind::kOutlier : LineKind::kProjected,
                 view.name + ", tag " + std::to_string(corner.tag_id) + ": " +
                     fixedText(corner.pattern_error_px.norm(), 2) + " px"});
    }
  }
  return lines;
}

}  // namespace

std::string coverageSection(const Calibration& calibration) {
  const Lens& projector = calibration.estimate.projector;
  const ResidualLines lines = projectorResiduals(calibration);
  const double magnification = lines.magnification(projector.width);
  const std::string counts =
      element("figure", countMap(calibration.coverage, projector) +
                            element("figcaption", "Projected corners measured in each cell.") +
                            countLegend());
  const std::string residuals = element(
      "figure",
      drawing(projector.width, projector.height, "Residuals over the projector’s picture",
              lines.onPaper(magnification, projector.width)) +
          element("figcaption",
                  "Every projected corner (dot) with what the calibration leaves unexplained: seen "
                  "minus expected, magnified " +
                      fixedText(magnification, 0) +
                      " times. Lines that agree with their neighbors mean that the lens model "
                      "misses something; lines in all directions are noise. Outliers are red and "
                      "cut short.") +
          lines.legendOnPaper());
  return element("h2", "Coverage of the projector’s picture") +
         element("p", element("strong", fixedText(100 * calibration.coverage.share(), 0) + " %") +
                          " of the cells hold measured corners. Where there are none the "
                          "calibration extrapolates: hold the board there, too, if light has to "
                          "be right there.") +
         "\n" + element("div", "class=\"two\"", counts + "\n" + residuals) + "\n";
}

}  // namespace afterglow::calib
