#include "nodes/pages/residual_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/number_text.hpp"

namespace afterglow::nodes {
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
