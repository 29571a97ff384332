#include <algorithm>

#include "calib/number_text.hpp"
#include "calib/report/html.hpp"
#include "calib/report/sections.hpp"
#include "calib/report/view_facts.hpp"

namespace afterglow::calib {
namespace {

bool isHeldOut(const ViewResult& view) { return view.is_used && view.held_out_px.has_value(); }

std::string boardDistances(const Calibration& calibration) {
  double nearest = 1e9, farthest = 0;
  for (const ViewResult& view : calibration.views) {
    if (!view.is_used || view.residuals.empty()) continue;
    const double distance = factsOf(view, calibration.estimate).distance_m;
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, distance);
  }
  if (farthest == 0) return "";
  return ", on boards " + fixedText(nearest, 2) + " to " + fixedText(farthest, 2) +
         " m from the projector";
}

std::string meaning(const Calibration& calibration) {
  const auto count = std::count_if(calibration.views.begin(), calibration.views.end(), isHeldOut);
  return element("p",
                 "Each view in turn was kept back, the projector calibrated from the others, and "
                 "the light predicted in the view kept back. It lay " +
                     element("strong", twoDigits(calibration.held_out_rms_mm) + " mm") +
                     " from the prediction: root mean square over " + std::to_string(count) +
                     " views" + boardDistances(calibration) + ".") +
         element("p", "class=\"soft\"",
                 "This is what to expect where the calibration is used. The training error below "
                 "it is measured on the views that made the calibration; it is never larger and "
                 "proves nothing by itself.");
}

std::string headlineBox(const Calibration& calibration) {
  const bool is_measured =
      std::any_of(calibration.views.begin(), calibration.views.end(), isHeldOut);
  if (!is_measured) {
    return element("div", "class=\"headline\"",
                   element("div", element("div", "class=\"label\"", "Leave-one-view-out error") +
                                      element("div", "class=\"second\"", "not measured")) +
                       element("p",
                               "No view was kept back, so nothing here says how right this "
                               "calibration is."));
  }
  const std::string numbers =
      element("div", "class=\"label\"", "Leave-one-view-out error (RMS)") +
      element("div", "class=\"big\"",
              twoDigits(calibration.held_out_rms_mm) + element("small", " mm")) +
      element("div", "class=\"second\"",
              fixedText(calibration.held_out_rms_px, 3) + " px of the projector");
  return element("div", "class=\"headline\"",
                 element("div", numbers) + element("div", meaning(calibration)));
}

std::string fact(const std::string& name, const std::string& value, const std::string& remark) {
  return element("div",
                 element("dt", name) + element("dd", value + " " + element("small", remark))) +
         "\n";
}

std::string secondaryFacts(const Calibration& calibration) {
  const std::string views =
      std::to_string(usedViews(calibration)) + " of " + std::to_string(calibration.views.size());
  return element(
      "dl", "class=\"facts\"",
      fact("Training error (RMS)", fixedText(calibration.training_rms_px, 3) + " px",
           "projector pixels") +
          fact("Printed corners (RMS)", fixedText(calibration.board_rms_px, 3) + " px",
               "camera pixels") +
          fact("Uncertainty on the boards", twoDigits(calibration.predicted_mm) + " mm",
               calibration.camera_change.fate == CameraFate::Held ? "95 %, without the camera’s"
                                                                  : "95 %, with the camera’s") +
          fact("Views used", views, "") +
          fact("Projector’s picture covered",
               fixedText(100 * calibration.coverage.share(), 0) + " %", "of its cells"));
}

std::string leftOut(const Calibration& calibration) {
  std::string items;
  for (const ViewResult& view : calibration.views) {
    if (view.is_used) continue;
    items += element("li", element("strong", escaped(view.name)) + ": " + escaped(view.reason));
  }
  if (items.empty()) return "";
  return element("div", "class=\"note bad\"", element("h3", "Left out") + element("ul", items)) +
         "\n";
}

/// Said under "Left out" already.
bool isAboutLeftOut(const std::string& warning, const Calibration& calibration) {
  return std::any_of(calibration.views.begin(), calibration.views.end(),
                     [&](const ViewResult& view) {
                       return !view.is_used && warning.rfind(view.name + " left out", 0) == 0;
                     });
}

std::string warnings(const Calibration& calibration) {
  std::string items;
  for (const std::string& warning : calibration.warnings) {
    if (!isAboutLeftOut(warning, calibration)) items += element("li", escaped(warning));
  }
  if (items.empty()) return "";
  return element("div", "class=\"note\"", element("h3", "Be careful") + element("ul", items)) +
         "\n";
}

std::string optionalCell(const std::optional<double>& value, int decimals) {
  return numberCell(value ? fixedText(*value, decimals) : "–");
}

/// Training (thin, grey) inside held out (blue), so that a view that only fits itself shows.
std::string bar(const ViewResult& view, double largest_px) {
  const double scale = largest_px > 0 ? 100 / largest_px : 0;
  const auto strip = [&](double value, const char* color, double top, double height) {
    return "<rect x=\"0\" y=\"" + coordinate(top) + "\" width=\"" +
           coordinate(std::min(100.0, value * scale)) + "\" height=\"" + coordinate(height) +
           "\" fill=\"" + color + "\"/>";
  };
  return element("td", "class=\"bar\"",
                 element("svg", "viewBox=\"0 0 100 12\" preserveAspectRatio=\"none\"",
                         strip(view.held_out_px.value_or(0), "#8fbbe0", 1, 10) +
                             strip(view.projected_rms_px, "#0b5fa5", 4, 4)));
}

std::string viewRow(const ViewResult& view, std::size_t index, const Calibration& calibration,
                    double largest_px) {
  const std::string name =
      "<a href=\"#view-" + std::to_string(index) + "\">" + escaped(view.name) + "</a>";
  if (!view.is_used) {
    return element("tr", "class=\"out\"",
                   element("td", name) + element("td", "colspan=\"9\"",
                                                 element("span", "class=\"pill\"", "left out") +
                                                     " " + escaped(view.reason))) +
           "\n";
  }
  const ViewFacts facts = factsOf(view, calibration.estimate);
  return element("tr", element("td", name) + numberCell(fixedText(facts.distance_m, 2)) +
                           numberCell(fixedText(facts.tilt_deg, 0) + " " + facts.turned) +
                           numberCell(std::to_string(facts.printed) + " + " +
                                      std::to_string(facts.projected)) +
                           numberCell(std::to_string(facts.outliers)) +
                           numberCell(fixedText(view.projected_rms_px, 3)) +
                           optionalCell(facts.training_mm, 3) + optionalCell(view.held_out_px, 3) +
                           optionalCell(view.held_out_mm, 3) + bar(view, largest_px)) +
         "\n";
}

std::string totalRow(const Calibration& calibration) {
  return element("tr", "class=\"sum\"",
                 element("td", "All used") + numberCell("") + numberCell("") + numberCell("") +
                     numberCell("") + numberCell(fixedText(calibration.training_rms_px, 3)) +
                     numberCell("") + numberCell(fixedText(calibration.held_out_rms_px, 3)) +
                     numberCell(fixedText(calibration.held_out_rms_mm, 3)) + element("td", "")) +
         "\n";
}

}  // namespace

std::string headlineSection(const Calibration& calibration) {
  return headlineBox(calibration) + "\n" + secondaryFacts(calibration) + "\n" +
         leftOut(calibration) + warnings(calibration);
}

std::string viewTableSection(const Calibration& calibration) {
  double largest = 0;
  for (const ViewResult& view : calibration.views) {
    largest = std::max({largest, view.held_out_px.value_or(0), view.projected_rms_px});
  }
  const auto head = [](const std::string& text) { return element("th", "class=\"n\"", text); };
  std::string rows = element(
      "thead", element("tr", element("th", "View") + head("Distance<br/>m") + head("Tilt<br/>°") +
                                 head("Corners<br/>printed + projected") + head("Out-<br/>liers") +
                                 head("Training<br/>px") + head("Training<br/>mm") +
                                 head("Held out<br/>px") + head("Held out<br/>mm") +
                                 element("th", "Held out (light) and<br/>training (dark), px")));
  for (std::size_t i = 0; i < calibration.views.size(); ++i) {
    rows += viewRow(calibration.views[i], i, calibration, largest);
  }
  return element("h2", "View by view") +
         element("p",
                 "Root mean squares of the projected corners, in the projector’s pixels and "
                 "in millimeters on the board. Distance: from the projector’s lens to the "
                 "board’s middle. Tilt: between the board’s normal and the projector’s axis; "
                 "the arrow says where, seen from the projector, the board’s face turns to.") +
         "\n" + element("table", rows + totalRow(calibration)) + "\n";
}

}  // namespace afterglow::calib
