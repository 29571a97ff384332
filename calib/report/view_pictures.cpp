#include <algorithm>

#include "calib/number_text.hpp"
#include "calib/report/html.hpp"
#include "calib/report/residual_lines.hpp"
#include "calib/report/sections.hpp"
#include "calib/report/view_facts.hpp"

namespace afterglow::calib {
namespace {

/// Enough to tell the tags apart on half a page; a tenth of a megabyte a view.
constexpr int kWidest = 800;

const Picture* pictureOf(const std::string& name, const std::vector<Photographs>& photographs) {
  const auto found = std::find_if(photographs.begin(), photographs.end(),
                                  [&](const Photographs& each) { return each.name == name; });
  if (found == photographs.end() || found->pattern.pixels.empty()) return nullptr;
  return &found->pattern;
}

ResidualLines linesOf(const ViewResult& view) {
  ResidualLines lines;
  for (const CornerResidual& corner : view.residuals) {
    const LineKind kind = corner.is_outlier     ? LineKind::kOutlier
                          : corner.is_projected ? LineKind::kProjected
                                                : LineKind::kPrinted;
    lines.add({corner.camera_px, corner.error_px, kind,
               std::string(corner.is_projected ? "projected" : "printed") + " tag " +
                   std::to_string(corner.tag_id) + ", corner " + std::to_string(corner.corner) +
                   ": " + fixedText(corner.error_px.norm(), 2) + " px"});
  }
  return lines;
}

/// One for all views, so that they can be compared.
double commonMagnification(const std::vector<ViewResult>& views, int width) {
  ResidualLines all;
  for (const ViewResult& view : views) {
    if (!view.is_used) continue;
    for (const CornerResidual& corner : view.residuals) {
      if (!corner.is_outlier) all.add({corner.camera_px, corner.error_px, LineKind::kPrinted, ""});
    }
  }
  return all.magnification(width);
}

std::string photograph(const ViewResult& view, const Picture* picture, double magnification) {
  if (picture == nullptr) return element("p", "class=\"soft\"", "No photograph was kept.");
  const std::string image =
      "<image x=\"-0.5\" y=\"-0.5\" width=\"" + std::to_string(picture->width) + "\" height=\"" +
      std::to_string(picture->height) + "\" href=\"" + dataUri(*picture, kWidest) + "\"/>";
  const ResidualLines lines = linesOf(view);
  const std::string residuals =
      lines.empty() ? "" : lines.onPhotograph(magnification, picture->width, picture->height);
  return drawing(picture->width, picture->height, "Photograph of " + view.name, image + residuals);
}

std::string usedCaption(const ViewResult& view, const ProjectorEstimate& estimate) {
  const ViewFacts facts = factsOf(view, estimate);
  std::string text = fixedText(facts.distance_m, 2) + " m, tilted " + fixedText(facts.tilt_deg, 0) +
                     "° " + facts.turned + " · " + std::to_string(facts.printed) + " printed and " +
                     std::to_string(facts.projected) + " projected corners";
  if (facts.outliers > 0) text += ", " + std::to_string(facts.outliers) + " of them outliers";
  if (view.held_out_px) text += " · held out " + fixedText(*view.held_out_px, 3) + " px";
  if (view.held_out_mm) text += ", " + fixedText(*view.held_out_mm, 2) + " mm";
  return text;
}

std::string viewFigure(const ViewResult& view, std::size_t index, const std::string& caption,
                       const std::string& picture) {
  const std::string mark = view.is_used ? "" : " " + element("span", "class=\"pill\"", "left out");
  return element("figure", "id=\"view-" + std::to_string(index) + "\"",
                 element("h3", escaped(view.name) + mark) + element("p", caption) + picture) +
         "\n";
}

int widthOf(const std::vector<Photographs>& photographs, int otherwise) {
  for (const Photographs& each : photographs) {
    if (each.pattern.width > 0) return each.pattern.width;
  }
  return otherwise;
}

}  // namespace

std::string viewPictureSection(const Calibration& calibration,
                               const std::vector<Photographs>& photographs) {
  const double magnification =
      commonMagnification(calibration.views, widthOf(photographs, calibration.camera.width));
  ResidualLines all;
  std::string figures;
  for (std::size_t i = 0; i < calibration.views.size(); ++i) {
    const ViewResult& view = calibration.views[i];
    for (const CornerResidual& corner : view.residuals) {
      all.add({corner.camera_px, corner.error_px,
               corner.is_outlier     ? LineKind::kOutlier
               : corner.is_projected ? LineKind::kProjected
                                     : LineKind::kPrinted,
               ""});
    }
    const std::string caption =
        view.is_used ? usedCaption(view, calibration.estimate) : escaped(view.reason);
    figures += viewFigure(view, i, caption,
                          photograph(view, pictureOf(view.name, photographs), magnification));
  }
  return element("h2", "The photographs and their residuals") +
         element("p",
                 "A line leads from each corner the way it is off: seen minus expected, in "
                 "the photograph’s pixels, magnified " +
                     element("strong", fixedText(magnification, 0) + " times") +
                     " in every picture. The bar at the bottom left shows a length in real "
                     "pixels. Outliers are ringed; their lines are cut to length.") +
         all.legendOnPhotograph() + "\n" + element("div", "class=\"two\"", figures) + "\n";
}

std::string refusedViewSection(const std::vector<ViewResult>& views,
                               const std::vector<Photographs>& photographs) {
  std::vector<ViewResult> shown = views;
  // Refused before anything was looked at: the photographs still tell what there was.
  for (const Photographs& each : photographs) {
    const bool is_known = std::any_of(views.begin(), views.end(),
                                      [&](const auto& view) { return view.name == each.name; });
    if (is_known) continue;
    ViewResult view;
    view.name = each.name;
    view.reason = "not looked at before the calibration was refused";
    shown.push_back(view);
  }
  if (shown.empty()) return "";
  const double magnification = commonMagnification(shown, widthOf(photographs, 1000));
  std::string figures;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const ViewResult& view = shown[i];
    const auto projected =
        std::count_if(view.residuals.begin(), view.residuals.end(),
                      [](const CornerResidual& corner) { return corner.is_projected; });
    std::string caption = escaped(view.reason);
    if (!view.residuals.empty()) {
      const auto printed = static_cast<std::ptrdiff_t>(view.residuals.size()) - projected;
      caption += (caption.empty() ? "" : " · ") + std::to_string(printed) + " printed and " +
                 std::to_string(projected) + " projected corners seen";
    } else if (caption.empty()) {
      caption = "nothing wrong was found with this view";
    }
    figures += viewFigure(view, i, caption,
                          photograph(view, pictureOf(view.name, photographs), magnification));
  }
  return element("h2", "What each view showed") + element("div", "class=\"two\"", figures) + "\n";
}

}  // namespace afterglow::calib
