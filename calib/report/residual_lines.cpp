#include "calib/report/residual_lines.hpp"

#include <algorithm>
#include <cmath>

#include "calib/number_text.hpp"
#include "calib/report/html.hpp"

namespace afterglow::calib {
namespace {

struct Style {
  LineKind kind;
  const char* on_photograph;
  const char* on_paper;
  const char* name;
};
constexpr Style kStyles[] = {
    {LineKind::kPrinted, "#00c2ff", "#0077c8", "printed corner"},
    {LineKind::kProjected, "#ffb000", "#0b5fa5", "projected corner"},
    {LineKind::kOutlier, "#ff2457", "#d1002f", "outlier"},
};

/// Longer lines than this share of the picture's width are cut: they would cross everything.
constexpr double kLongest = 0.08;

std::string stroke(const std::string& d, const std::string& color, double width,
                   double opacity = 1) {
  if (d.empty()) return "";
  return "<path d=\"" + d + "\" stroke=\"" + color + "\" stroke-width=\"" + coordinate(width) +
         "\"" + (opacity < 1 ? " stroke-opacity=\"" + coordinate(opacity) + "\"" : "") + "/>";
}

}  // namespace

void ResidualLines::add(const ResidualLine& line) {
  if (line.at.allFinite() && line.error.allFinite()) lines_.push_back(line);
}

void ResidualLines::add(const ResidualLines& others) {
  lines_.insert(lines_.end(), others.lines_.begin(), others.lines_.end());
}

bool ResidualLines::hasErrors() const {
  return std::any_of(lines_.begin(), lines_.end(),
                     [](const ResidualLine& line) { return !line.error.isZero(0); });
}

bool ResidualLines::has(LineKind kind) const {
  return std::any_of(lines_.begin(), lines_.end(),
                     [&](const ResidualLine& line) { return line.kind == kind; });
}

double ResidualLines::magnification(int picture_width) const {
  std::vector<double> lengths;
  for (const ResidualLine& line : lines_) {
    if (line.kind != LineKind::kOutlier) lengths.push_back(line.error.norm());
  }
  const double typical = quantile(lengths, 0.9);
  if (!(typical > 0)) return 1;
  return std::max(1.0, std::min(10000.0, roundDown(picture_width / 40.0 / typical)));
}

std::string ResidualLines::path(LineKind kind, double magnification, double longest) const {
  std::string d;
  for (const ResidualLine& line : lines_) {
    if (line.kind != kind) continue;
    Eigen::Vector2d drawn = line.error * magnification;
    if (drawn.norm() > longest) drawn *= longest / drawn.norm();
    d += "M" + point(line.at) + "l" + point(drawn);
  }
  return d;
}

/// A line of no length with round ends is a dot.
std::string ResidualLines::dots(LineKind kind) const {
  std::string d;
  for (const ResidualLine& line : lines_) {
    if (line.kind == kind) d += "M" + point(line.at) + "h0";
  }
  return d;
}

std::string ResidualLines::outlierRings(int width) const {
  std::string markup;
  for (const ResidualLine& line : lines_) {
    if (line.kind != LineKind::kOutlier) continue;
    markup += element("circle",
                      "cx=\"" + coordinate(line.at.x()) + "\" cy=\"" + coordinate(line.at.y()) +
                          "\" r=\"" + coordinate(width / 110.0) +
                          "\" stroke=\"#ff2457\" stroke-width=\"1.8\" pointer-events=\"all\"",
                      element("title", escaped(line.remark)));
  }
  return markup;
}

std::string ResidualLines::lengthBar(double magnification, int width, int height) {
  const double bar_px = roundDown(width / 8.0 / magnification);
  const double left = 0.03 * width, bottom = height - 0.04 * width;
  const std::string bar = "M" + point({left, bottom}) + "h" + coordinate(bar_px * magnification);
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(bar_px) + 1e-9)));
  const std::string label =
      element("text",
              "x=\"" + coordinate(left) + "\" y=\"" + coordinate(bottom - 0.012 * width) +
                  "\" font-size=\"" + coordinate(0.026 * width) +
                  "\" fill=\"#fff\" stroke=\"#000\" stroke-opacity=\"0.7\" stroke-width=\"" +
                  coordinate(0.005 * width) + "\" paint-order=\"stroke\"",
              fixedText(bar_px, decimals) + " px");
  return stroke(bar, "#000", 5, 0.7) + stroke(bar, "#fff", 2.4) + label;
}

std::string ResidualLines::onPhotograph(double magnification, int width, int height) const {
  std::string halo, colors;
  for (const Style& style : kStyles) {
    const std::string lines = path(style.kind, magnification, kLongest * width);
    halo += stroke(lines, "#000", 2.8, 0.5) + stroke(dots(style.kind), "#000", 4.4, 0.5);
    colors += stroke(lines, style.on_photograph, 1.3) +
              stroke(dots(style.kind), style.on_photograph, 2.8);
  }
  return halo + colors + outlierRings(width) +
         (hasErrors() ? lengthBar(magnification, width, height) : "");
}

std::string ResidualLines::onPaper(double magnification, int width) const {
  std::string markup;
  for (const Style& style : kStyles) {
    markup += stroke(path(style.kind, magnification, kLongest * width), style.on_paper, 1, 0.75) +
              stroke(dots(style.kind), style.on_paper, 2.2);
  }
  return markup + outlierRings(width);
}

std::string ResidualLines::legendOnPhotograph() const { return legend(false); }

std::string ResidualLines::legendOnPaper() const { return legend(true); }

std::string ResidualLines::legend(bool is_on_paper) const {
  if (lines_.empty()) return "";
  std::string markup;
  for (const Style& style : kStyles) {
    if (!has(style.kind)) continue;
    const std::string color = is_on_paper ? style.on_paper : style.on_photograph;
    markup += element(
        "span", element("i", "class=\"line\" style=\"background:" + color + "\"", "") + style.name);
  }
  return element("div", "class=\"legend\"", markup);
}

}  // namespace afterglow::calib
