#include "calib/report/view_photograph.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "calib/number_text.hpp"
#include "calib/report/html.hpp"

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

/// The part of a picture that is shown.
struct Part {
  int left = 0, top = 0, width = 0, height = 0;
};

/// The board with a margin of a fifth of its size, in the picture's own shape.
Part shownPart(const ViewResult& view, const Picture& picture) {
  constexpr double kMargin = 0.2;
  const Part whole{0, 0, picture.width, picture.height};
  Eigen::AlignedBox2d corners;
  for (const CornerResidual& corner : view.residuals) {
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

Picture cut(const Picture& picture, const Part& part) {
  Picture result;
  result.width = part.width;
  result.height = part.height;
  for (int y = part.top; y < part.top + part.height; ++y) {
    const auto row = picture.pixels.begin() + static_cast<std::ptrdiff_t>(y) * picture.width;
    result.pixels.insert(result.pixels.end(), row + part.left, row + part.left + part.width);
  }
  return result;
}

}  // namespace

ResidualLines photographLines(const ViewResult& view, const Eigen::Vector2d& origin) {
  ResidualLines lines;
  for (const CornerResidual& corner : view.residuals) {
    const LineKind kind = corner.is_outlier     ? LineKind::kOutlier
                          : corner.is_projected ? LineKind::kProjected
                                                : LineKind::kPrinted;
    lines.add({corner.camera_px - origin, corner.error_px, kind,
               std::string(corner.is_projected ? "projected" : "printed") + " tag " +
                   std::to_string(corner.tag_id) + ", corner " + std::to_string(corner.corner) +
                   ": " + fixedText(corner.error_px.norm(), 2) + " px"});
  }
  return lines;
}

std::string viewPhotograph(const ViewResult& view, const std::vector<Photographs>& photographs,
                           double magnification) {
  const Picture* const picture = pictureOf(view.name, photographs);
  if (picture == nullptr) return element("p", "class=\"soft\"", "No photograph was kept.");
  const Part part = shownPart(view, *picture);
  const std::string image = "<image x=\"-0.5\" y=\"-0.5\" width=\"" + std::to_string(part.width) +
                            "\" height=\"" + std::to_string(part.height) + "\" href=\"" +
                            dataUri(cut(*picture, part), kWidest) + "\"/>";
  const ResidualLines lines = photographLines(view, Eigen::Vector2d(part.left, part.top));
  const std::string residuals =
      lines.empty() ? "" : lines.onPhotograph(magnification, part.width, part.height);
  return drawing(part.width, part.height, "Photograph of " + view.name, image + residuals);
}

}  // namespace afterglow::calib
