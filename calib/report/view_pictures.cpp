#include <algorithm>
#include <iterator>

#include "calib/number_text.hpp"
#include "calib/report/html.hpp"
#include "calib/report/sections.hpp"
#include "calib/report/view_facts.hpp"
#include "calib/report/view_photograph.hpp"

namespace afterglow::calib {
namespace {

int widthOf(const std::vector<Photographs>& photographs) {
  for (const Photographs& each : photographs) {
    if (each.pattern.width > 0) return each.pattern.width;
  }
  return 1280;
}

/// One magnification for all views, so that they can be compared.
double commonMagnification(const std::vector<ViewResult>& views,
                           const std::vector<Photographs>& photographs) {
  ResidualLines all;
  for (const ViewResult& view : views) all.add(photographLines(view));
  return all.magnification(widthOf(photographs));
}

std::vector<ViewResult> used(const std::vector<ViewResult>& views) {
  std::vector<ViewResult> result;
  std::copy_if(views.begin(), views.end(), std::back_inserter(result),
               [](const ViewResult& view) { return view.is_used; });
  return result;
}

std::string usedCaption(const ViewResult& view, const ProjectorEstimate& estimate) {
  const ViewFacts facts = factsOf(view, estimate);
  std::string text = fixedText(facts.distance_m, 2) + " m, tilted " + fixedText(facts.tilt_deg, 0) +
                     "° " + facts.turned + " · " + std::to_string(facts.printed) + " printed, " +
                     std::to_string(facts.projected) + " projected corners";
  if (facts.outliers > 0) {
    text += ", " + std::to_string(facts.outliers) + (facts.outliers > 1 ? " outliers" : " outlier");
  }
  return text;
}

std::string headRemark(const ViewResult& view) {
  if (!view.is_used) return element("span", "class=\"pill\"", "left out");
  if (!view.held_out_px || !view.held_out_mm) return "";
  return element("span", "class=\"right\"",
                 "held out " + fixedText(*view.held_out_px, 3) + " px, " +
                     twoDigits(*view.held_out_mm) + " mm");
}

std::string viewFigure(const ViewResult& view, std::size_t index, const std::string& remark,
                       const std::string& caption, const std::string& picture) {
  return element(
             "figure", "id=\"view-" + std::to_string(index) + "\"",
             element("h3", escaped(view.name) + " " + remark) + element("p", caption) + picture) +
         "\n";
}

std::string refusedCaption(const ViewResult& view) {
  std::string text = escaped(view.reason);
  if (view.residuals.empty()) return text.empty() ? "no tags were read in it" : text;
  const auto projected =
      std::count_if(view.residuals.begin(), view.residuals.end(),
                    [](const CornerResidual& corner) { return corner.is_projected; });
  const auto printed = static_cast<std::ptrdiff_t>(view.residuals.size()) - projected;
  return text + (text.empty() ? "" : " · ") + std::to_string(printed) + " printed and " +
         std::to_string(projected) + " projected corners seen";
}

/// With the photographs that were not looked at before the calibration was refused.
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

std::string viewPictureSection(const Calibration& calibration,
                               const std::vector<Photographs>& photographs) {
  const double magnification = commonMagnification(used(calibration.views), photographs);
  ResidualLines all;
  std::string figures;
  for (std::size_t i = 0; i < calibration.views.size(); ++i) {
    const ViewResult& view = calibration.views[i];
    all.add(photographLines(view));
    const std::string caption =
        view.is_used ? usedCaption(view, calibration.estimate) : escaped(view.reason);
    figures += viewFigure(view, i, headRemark(view), caption,
                          viewPhotograph(view, photographs, magnification));
  }
  return element("h2", "The photographs and their residuals") +
         element("p",
                 "A line leads from each corner the way it is off: seen minus expected, in the "
                 "photograph’s pixels, magnified " +
                     element("strong", fixedText(magnification, 0) + " times") +
                     " in every picture; the bar at the bottom left shows a length in real "
                     "pixels. Pictures are cut to the board. Outliers are ringed, and their lines "
                     "cut short.") +
         all.legendOnPhotograph() + "\n" + element("div", "class=\"two views\"", figures) + "\n";
}

std::string refusedViewSection(const std::vector<ViewResult>& views,
                               const std::vector<Photographs>& photographs) {
  const std::vector<ViewResult> shown = withUnseen(views, photographs);
  if (shown.empty()) return "";
  const double magnification = commonMagnification(shown, photographs);
  ResidualLines all;
  std::string figures;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    all.add(photographLines(shown[i]));
    const std::string remark =
        shown[i].reason.empty() ? "" : element("span", "class=\"pill\"", "not usable");
    figures += viewFigure(shown[i], i, remark, refusedCaption(shown[i]),
                          viewPhotograph(shown[i], photographs, magnification));
  }
  const std::string errors =
      all.hasErrors() ? element("p",
                                "Lines show how far each corner is off where the calibration "
                                "stopped, in the photograph’s pixels, magnified " +
                                    fixedText(magnification, 0) + " times.")
                      : "";
  return element("h2", "What each view showed") + errors + all.legendOnPhotograph() + "\n" +
         element("div", "class=\"two views\"", figures) + "\n";
}

}  // namespace afterglow::calib
