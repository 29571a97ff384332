#include "calib/verify/throw_picture.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>

#include "calib/detection/board_pose.hpp"
#include "calib/detection/tag_detector.hpp"
#include "calib/detection/tag_fit.hpp"
#include "calib/lens.hpp"
#include "calib/number_text.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {
namespace {

constexpr double kWorstFit_px = 2, kMovedCamera_px = 1.5;

void requireSize(const Picture& picture, const Lens& camera) {
  if (picture.width == camera.width && picture.height == camera.height) return;
  throw std::invalid_argument(
      fmt::format("the photograph is {} x {} pixels, the camera's file says {} x {}", picture.width,
                  picture.height, camera.width, camera.height));
}

/// The tags of the layout among the detected ones; the surest if an id is seen twice.
std::vector<DetectedTag> pick(const std::vector<DetectedTag>& found,
                              const std::vector<Tag>& wanted) {
  std::vector<DetectedTag> picked;
  for (const Tag& tag : wanted) {
    const DetectedTag* best = nullptr;
    for (const DetectedTag& candidate : found) {
      const bool is_better = best == nullptr || candidate.margin > best->margin;
      if (candidate.id == tag.id && is_better) best = &candidate;
    }
    if (best != nullptr) picked.push_back(*best);
  }
  return picked;
}

/// Reads tags of a layout in one photograph, to a fraction of a pixel.
class LayoutReader {
 public:
  LayoutReader(const std::string& family, const Lens& camera)
      : family_(family), camera_(camera), rays_(camera), detector_(family) {}

  std::vector<DetectedTag> find(const Picture& picture, const std::vector<Tag>& wanted) const {
    return pick(detector_.detect(picture), wanted);
  }

  /// The fitted corners of the found tags; the detector's corners where the fit fails.
  std::vector<SeenTag> fit(const std::vector<DetectedTag>& found, const Light& light,
                           const std::vector<Tag>& wanted) const {
    std::vector<SeenTag> seen;
    for (const DetectedTag& start : found) {
      const auto tag = std::find_if(wanted.begin(), wanted.end(),
                                    [&](const Tag& other) { return other.id == start.id; });
      const TagTarget target{*tag, tagCells(family_, tag->id), nullptr};
      const auto fitted = fitTag(light, camera_, rays_, target, start.corners);
      SeenTag result;
      static_cast<Tag&>(result) = start;
      seen.push_back(fitted ? fitted->seen : result);
    }
    return seen;
  }

 private:
  std::string family_;
  const Lens& camera_;
  RayMap rays_;
  TagDetector detector_;
};

std::string notAsLaidOut(const std::string& how) {
  return "the printed tags do not lie as the layout says: " + how +
         "; measure their places and sizes again, and see that the camera's file is of this camera";
}

SurfacePose poseFrom(std::vector<SeenTag> seen, const TagLayout& layout, const Lens& camera) {
  const auto pose = boardPose({seen.begin(), seen.end()}, layout.tags, camera);
  if (!pose && seen.size() >= 2) {
    throw std::runtime_error(
        notAsLaidOut("no two of the " + std::to_string(seen.size()) + " seen agree"));
  }
  if (!pose) {
    throw std::runtime_error(
        fmt::format("{} of the layout's {} printed tags are seen in the photograph: at least 2 are "
                    "needed to know where the surface is; light them, or bring the camera nearer",
                    seen.size(), layout.tags.size()));
  }
  SurfacePose surface{pose->T_camera_board, std::move(seen), 0};
  double worst = 0, sum = 0;
  int worst_id = 0;
  for (const SeenTag& tag : surface.tags) {
    const auto known = std::find_if(layout.tags.begin(), layout.tags.end(),
                                    [&](const Tag& other) { return other.id == tag.id; });
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d& p = known->corners[i];
      const auto pixel =
          project(camera, surface.T_camera_surface * Eigen::Vector3d(p.x(), p.y(), 0));
      const double off = pixel ? (*pixel - tag.corners[i]).norm() : 1e3;
      sum += off * off;
      if (off > worst) {
        worst = off;
        worst_id = tag.id;
      }
    }
  }
  surface.rms_px = std::sqrt(sum / static_cast<double>(4 * surface.tags.size()));
  if (surface.rms_px > kWorstFit_px) {
    throw std::runtime_error(
        notAsLaidOut(fmt::format("{} px rms off, worst tag {} with {} px",
                                 fixedText(surface.rms_px, 1), worst_id, fixedText(worst, 1))));
  }
  return surface;
}

void requireSameView(const std::vector<DetectedTag>& plain, const std::vector<DetectedTag>& lit) {
  std::vector<double> shifts;
  for (const DetectedTag& a : plain) {
    const auto b =
        std::find_if(lit.begin(), lit.end(), [&](const auto& t) { return t.id == a.id; });
    if (b != lit.end()) shifts.push_back((middleOf(*b) - middleOf(a)).norm());
  }
  if (shifts.empty()) return;
  const auto middle = shifts.begin() + static_cast<std::ptrdiff_t>(shifts.size() / 2);
  std::nth_element(shifts.begin(), middle, shifts.end());
  if (*middle > kMovedCamera_px) {
    throw std::runtime_error(
        "the camera has moved between the two photographs: the printed tags "
        "by " +
        fixedText(*middle, 1) + " px; take both from one place");
  }
}

TargetCheck checkTarget(const Tag& target, const std::vector<SeenTag>& seen,
                        const SurfacePose& surface, const Lens& camera) {
  TargetCheck check;
  check.id = target.id;
  const auto found =
      std::find_if(seen.begin(), seen.end(), [&](const auto& t) { return t.id == target.id; });
  Tag landed = target;
  check.is_seen = found != seen.end();
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& p = target.corners[i];
    const auto pixel = project(camera, surface.T_camera_surface * Eigen::Vector3d(p.x(), p.y(), 0));
    check.wanted_px[i] = pixel.value_or(Eigen::Vector2d::Constant(-1e3));
    if (!check.is_seen) continue;
    check.corners_px[i] = found->corners[i];
    const auto place = landing(camera, found->corners[i], surface.T_camera_surface);
    if (!place) {
      check.is_seen = false;
      check.errors.clear();
      continue;
    }
    landed.corners[i] = *place;
    check.errors.push_back({target.id, static_cast<int>(i), p, *place});
  }
  if (check.is_seen) check.offset_mm = 1000 * (middleOf(landed) - middleOf(target));
  return check;
}

}  // namespace

SurfacePose locateSurface(const Picture& photograph, const TagLayout& layout, const Lens& camera) {
  requireSize(photograph, camera);
  const LayoutReader reader(layout.family, camera);
  const auto found = reader.find(photograph, layout.tags);
  return poseFrom(reader.fit(found, linearLight(photograph), layout.tags), layout, camera);
}

std::vector<LandingError> ThrowCheck::errors() const {
  std::vector<LandingError> all;
  for (const TargetCheck& target : targets) {
    all.insert(all.end(), target.errors.begin(), target.errors.end());
  }
  return all;
}

ThrowCheck checkThrow(const Picture& thrown, const std::optional<Picture>& plain,
                      const TagLayout& layout, const Lens& camera) {
  requireSize(thrown, camera);
  if (plain) requireSize(*plain, camera);
  const LayoutReader reader(layout.family, camera);
  // Printed tags are read in the photograph without the pattern's light, if there is one.
  const Picture& printed_in = plain ? *plain : thrown;
  const auto printed = reader.find(printed_in, layout.tags);
  if (plain) requireSameView(printed, reader.find(thrown, layout.tags));
  ThrowCheck check;
  check.surface =
      poseFrom(reader.fit(printed, linearLight(printed_in), layout.tags), layout, camera);
  const Light light =
      plain ? quotient(linearLight(thrown), linearLight(*plain)) : linearLight(thrown);
  std::vector<DetectedTag> found = reader.find(thrown, layout.targets);
  if (plain && found.size() < layout.targets.size()) {
    std::vector<DetectedTag> again = reader.find(encoded(light), layout.targets);
    if (again.size() > found.size()) found = std::move(again);
  }
  const auto seen = reader.fit(found, light, layout.targets);
  for (const Tag& target : layout.targets) {
    check.targets.push_back(checkTarget(target, seen, check.surface, camera));
  }
  return check;
}

namespace {

constexpr double kGamma = 2.2;
constexpr int kSamples = 8;          ///< a side and pixel
constexpr int kPointsAlongEdge = 8;  ///< a lens bends edges
constexpr double kLeastCellThrown_px = 3, kLeastCellSeen_px = 2.5;

/// Returns the map from the surface's meters to the tag's cells: (0, 0) top left, (8, 8) bottom
/// right.
Eigen::Affine2d cellsOf(const Tag& tag) {
  Eigen::Matrix2d axes;
  axes.col(0) = (tag.corners[1] - tag.corners[0]) / kTagCells;
  axes.col(1) = (tag.corners[3] - tag.corners[0]) / kTagCells;
  Eigen::Affine2d meters = Eigen::Affine2d::Identity();
  meters.linear() = axes;
  meters.translation() = tag.corners[0];
  return meters.inverse();
}

struct Extent {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = Eigen::Vector2d::Constant(-1e9);
  double least_edge = 1e9;
};

/// Returns the part of a lens's picture that a tag on the surface covers, with its white rim.
/// Throws naming it if that is not all within the picture, or too small.
Extent requireWithin(const Tag& tag, const Lens& lens, const Eigen::Isometry3d& T_optical_surface,
                     const std::string& whose, double least_cell_px) {
  const std::string name = "target " + std::to_string(tag.id);
  Extent extent;
  const Eigen::Vector2d middle = middleOf(tag);
  for (std::size_t i = 0; i < 4; ++i) {
    double edge = 0;
    std::optional<Eigen::Vector2d> before;
    for (int j = 0; j <= kPointsAlongEdge; ++j) {
      const Eigen::Vector2d at = tag.corners[i] + static_cast<double>(j) / kPointsAlongEdge *
                                                      (tag.corners[(i + 1) % 4] - tag.corners[i]);
      const Eigen::Vector2d p = middle + (kTagCells + 2.0) / kTagCells * (at - middle);
      const auto pixel = project(lens, T_optical_surface * Eigen::Vector3d(p.x(), p.y(), 0));
      const bool is_inside = pixel && pixel->x() > -0.5 && pixel->y() > -0.5 &&
                             pixel->x() < lens.width - 0.5 && pixel->y() < lens.height - 0.5;
      if (!is_inside) {
        throw std::runtime_error(name +
                                 (pixel ? " would be at pixel (" + fixedText(pixel->x(), 0) + ", " +
                                              fixedText(pixel->y(), 0) + "), outside the " + whose +
                                              "'s " + std::to_string(lens.width) + " x " +
                                              std::to_string(lens.height)
                                        : " is not in front of the " + whose + "'s lens") +
                                 "; choose another place");
      }
      extent.low = extent.low.cwiseMin(*pixel);
      extent.high = extent.high.cwiseMax(*pixel);
      if (before) edge += (*pixel - *before).norm();
      before = pixel;
    }
    extent.least_edge = std::min(extent.least_edge, edge);
  }
  const double cell = extent.least_edge / (kTagCells + 2);
  if (cell < least_cell_px) {
    throw std::runtime_error(name + ": its cells would be " + fixedText(cell, 1) + " px in the " +
                             whose + "'s picture, " + fixedText(least_cell_px, 1) +
                             " are needed; make it larger");
  }
  return extent;
}

/// Draws one tag; the surface's coordinates are interpolated within a pixel.
class TagPainter {
 public:
  TagPainter(const Tag& tag, const std::string& family, const Lens& lens,
             const Rigid<Projector, Surface>& T_projector_surface)
      : lens_(lens),
        T_projector_surface_(T_projector_surface),
        cells_of_(cellsOf(tag)),
        cells_(tagCells(family, tag.id)) {}

  void paint(const Extent& extent, Picture& picture) const {
    const int left = std::max(0, static_cast<int>(extent.low.x()) - 1);
    const int top = std::max(0, static_cast<int>(extent.low.y()) - 1);
    const int right = std::min(lens_.width - 1, static_cast<int>(extent.high.x()) + 2);
    const int bottom = std::min(lens_.height - 1, static_cast<int>(extent.high.y()) + 2);
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        const double share = blackShare(x, y);
        if (share <= 0) continue;
        picture.pixels[std::size_t(y) * std::size_t(picture.width) + std::size_t(x)] =
            static_cast<std::uint8_t>(std::lround(255 * std::pow(1 - share, 1 / kGamma)));
      }
    }
  }

 private:
  std::optional<Eigen::Vector2d> cellAt(double x, double y) const {
    const auto place = landing(lens_, {x, y}, T_projector_surface_);
    if (!place) return std::nullopt;
    return Eigen::Vector2d(cells_of_ * *place);
  }

  double blackShare(int x, int y) const {
    const auto a = cellAt(x - 0.5, y - 0.5), b = cellAt(x + 0.5, y - 0.5);
    const auto c = cellAt(x - 0.5, y + 0.5), d = cellAt(x + 0.5, y + 0.5);
    if (!a || !b || !c || !d) return 0;
    int black = 0;
    for (int i = 0; i < kSamples * kSamples; ++i) {
      const double u = (i % kSamples + 0.5) / kSamples;
      const double v = (static_cast<double>(i / kSamples) + 0.5) / kSamples;
      black += isBlack((1 - v) * ((1 - u) * *a + u * *b) + v * ((1 - u) * *c + u * *d)) ? 1 : 0;
    }
    return static_cast<double>(black) / (kSamples * kSamples);
  }

  bool isBlack(const Eigen::Vector2d& cell) const {
    if (cell.minCoeff() < 0 || cell.maxCoeff() >= kTagCells) return false;
    return cells_[static_cast<std::size_t>(cell.y())][static_cast<std::size_t>(cell.x())];
  }

  const Lens& lens_;
  const Rigid<Projector, Surface>& T_projector_surface_;
  Eigen::Affine2d cells_of_;
  TagCells cells_;
};

constexpr double kArrowScale = 10;
constexpr int kSubPixelBits = 4;
const cv::Scalar kGreen(60, 200, 60), kRed(60, 60, 240), kDarkEdge(20, 20, 20);

cv::Point fixedPoint(const Eigen::Vector2d& pixel) {
  return {static_cast<int>(std::lround(pixel.x() * (1 << kSubPixelBits))),
          static_cast<int>(std::lround(pixel.y() * (1 << kSubPixelBits)))};
}

void drawOutline(cv::Mat& image, const std::array<Eigen::Vector2d, 4>& corners,
                 const cv::Scalar& color) {
  for (std::size_t i = 0; i < 4; ++i) {
    cv::line(image, fixedPoint(corners[i]), fixedPoint(corners[(i + 1) % 4]), color, 1, cv::LINE_AA,
             kSubPixelBits);
  }
}

void drawLabel(cv::Mat& image, const std::string& text, const Eigen::Vector2d& at) {
  const cv::Point place(static_cast<int>(at.x()), static_cast<int>(at.y()) - 6);
  cv::putText(image, text, place, cv::FONT_HERSHEY_SIMPLEX, 0.5, kDarkEdge, 4, cv::LINE_AA);
  cv::putText(image, text, place, cv::FONT_HERSHEY_SIMPLEX, 0.5, {255, 255, 255}, 1, cv::LINE_AA);
}

void drawTarget(cv::Mat& image, const TargetCheck& target) {
  drawOutline(image, target.wanted_px, kGreen);
  const std::string name = std::to_string(target.id) + ": ";
  if (!target.is_seen) {
    drawLabel(image, name + "not seen", target.wanted_px[0]);
    return;
  }
  drawOutline(image, target.corners_px, kRed);
  Tag wanted, seen;
  wanted.corners = target.wanted_px;
  seen.corners = target.corners_px;
  const Eigen::Vector2d from = middleOf(wanted);
  const Eigen::Vector2d to = from + kArrowScale * (middleOf(seen) - from);
  cv::arrowedLine(image, fixedPoint(from), fixedPoint(to), kRed, 2, cv::LINE_AA, kSubPixelBits);
  drawLabel(image, name + fixedText(target.offset_mm.norm(), 1) + " mm", target.wanted_px[0]);
}

}  // namespace

Picture drawThrow(const TagLayout& layout, const Lens& projector,
                  const Rigid<Projector, Surface>& T_projector_surface) {
  Picture picture{projector.width, projector.height, {}};
  picture.pixels.assign(std::size_t(picture.width) * std::size_t(picture.height), 255);
  for (const Tag& target : layout.targets) {
    const Extent extent = requireWithin(target, projector, T_projector_surface.matrix(),
                                        "projector", kLeastCellThrown_px);
    TagPainter(target, layout.family, projector, T_projector_surface).paint(extent, picture);
  }
  return picture;
}

void requireVisible(const TagLayout& layout, const Lens& camera,
                    const Rigid<Camera, Surface>& T_camera_surface) {
  for (const Tag& target : layout.targets) {
    requireWithin(target, camera, T_camera_surface.matrix(), "camera", kLeastCellSeen_px);
  }
}

void saveErrorPicture(const std::string& path, const Picture& photograph, const ThrowCheck& check) {
  const cv::Mat gray(photograph.height, photograph.width, CV_8U,
                     const_cast<std::uint8_t*>(photograph.pixels.data()));
  cv::Mat image;
  cv::cvtColor(gray, image, cv::COLOR_GRAY2BGR);
  for (const TargetCheck& target : check.targets) drawTarget(image, target);
  bool is_written = false;
  try {
    is_written = cv::imwrite(path, image);
  } catch (const cv::Exception&) {  // an ending it has no format for
  }
  if (!is_written) throw std::runtime_error(path + ": cannot be written as a picture");
}

}  // namespace afterglow::calib
