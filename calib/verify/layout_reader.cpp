#include "calib/verify/layout_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/detection/board_pose.hpp"
#include "calib/detection/tag_detector.hpp"
#include "calib/detection/tag_fit.hpp"
#include "calib/lens.hpp"
#include "calib/number_text.hpp"

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

}  // namespace afterglow::calib
