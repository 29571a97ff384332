// Before solving: whether the views together can calibrate a projector.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/degrees.hpp"
#include "calib/solver/refusals.hpp"

namespace afterglow::calib {
namespace {

constexpr std::size_t kFewestViews = 3;
/// Largest angle between two boards' normals that leaves focal length and distance apart.
constexpr double kSmallestTilt_deg = 10;
constexpr double kNearest_m = 0.1, kFarthest_m = 15;
constexpr std::size_t kFewestCorners = 40;
/// Of the projector's picture, from the first to the last corner. A camera beside a short throw
/// sees little of the picture's height.
constexpr double kSmallestAcross = 0.4, kSmallestDown = 0.25;
/// Of the cells of the coverage.
constexpr double kSmallestShare = 0.1;
/// The third of the picture at a side counts as empty with less than this share of the corners.
constexpr double kEmptyThird = 0.01;

double largestTilt_deg(const std::vector<PosedView>& views) {
  double largest = 0;
  for (const PosedView& a : views) {
    for (const PosedView& b : views) {
      const double cosine = std::clamp(a.normal().dot(b.normal()), -1.0, 1.0);
      largest = std::max(largest, std::acos(cosine) * kDegrees);
    }
  }
  return largest;
}

/// Which way boards were not tilted yet: about the camera's vertical or horizontal axis.
std::string missingTilt(const std::vector<PosedView>& views) {
  Eigen::Vector3d low = views[0].normal(), high = low;
  for (const PosedView& view : views) {
    low = low.cwiseMin(view.normal());
    high = high.cwiseMax(view.normal());
  }
  const Eigen::Vector3d range = high - low;
  const double few = std::sin(kSmallestTilt_deg / kDegrees);
  if (range.x() < few && range.y() < few) return "tilt it left, right, up and down by 20 to 40 deg";
  return range.x() < few ? "tilt it left and right by 20 to 40 deg"
                         : "tilt it up and down by 20 to 40 deg";
}

void judgePoses(const std::vector<PosedView>& views, std::vector<std::string>& reasons) {
  if (views.size() < kFewestViews) {
    reasons.push_back(fmt::format("{} usable view{}: at least {} are needed, 12 to 16 are good",
                                  views.size(), views.size() == 1 ? "" : "s", kFewestViews));
  }
  if (views.empty()) return;
  const double tilt = largestTilt_deg(views);
  if (views.size() >= kFewestViews && tilt < kSmallestTilt_deg) {
    reasons.push_back(
        fmt::format("the boards are parallel (within {:.1f} deg), which leaves the projector's "
                    "distance and focal length open: {}",
                    tilt, missingTilt(views)));
  }
}

void judgeDistance(const std::vector<PosedView>& views, const Board& board,
                   std::vector<std::string>& reasons) {
  std::vector<double> distances;
  for (const PosedView& view : views) {
    distances.push_back(view.T_camera_board.matrix().translation().norm());
  }
  if (distances.empty()) return;
  const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  if (*middle >= kNearest_m && *middle <= kFarthest_m) return;
  reasons.push_back(
      fmt::format("the board seems to be {:.3g} m away from the camera: is its layout "
                  "({:.3g} x {:.3g} m) in meters, and is the camera_info this camera's?",
                  *middle, board.size_m.x(), board.size_m.y()));
}

/// Names of the sides of the projector's picture where (nearly) no corner was seen.
std::vector<std::string> emptySides(const std::vector<Eigen::Vector2d>& corners,
                                    const Pattern& pattern) {
  std::array<double, 3> across{}, down{};
  for (const Eigen::Vector2d& corner : corners) {
    const auto third = [](double at, int size) {
      return std::size_t(std::clamp(static_cast<int>(3 * (at + 0.5) / size), 0, 2));
    };
    across[third(corner.x(), pattern.width)] += 1.0 / double(corners.size());
    down[third(corner.y(), pattern.height)] += 1.0 / double(corners.size());
  }
  std::vector<std::string> sides;
  if (across[0] < kEmptyThird) sides.push_back("left");
  if (across[2] < kEmptyThird) sides.push_back("right");
  if (down[0] < kEmptyThird) sides.push_back("upper");
  if (down[2] < kEmptyThird) sides.push_back("lower");
  return sides;
}

void judgeCorners(const std::vector<PosedView>& views, const Pattern& pattern,
                  std::vector<std::string>& reasons) {
  std::vector<Eigen::Vector2d> corners;
  for (const PosedView& view : views) {
    corners.insert(corners.end(), view.lit_px.begin(), view.lit_px.end());
  }
  if (corners.size() < kFewestCorners) {
    reasons.push_back(
        fmt::format("{} projected corners were seen on the boards: at least {} are needed; hold "
                    "the board so that more of the pattern falls into its free middle",
                    corners.size(), kFewestCorners));
    return;
  }
  Eigen::Vector2d low = corners[0], high = corners[0];
  for (const Eigen::Vector2d& corner : corners) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  const Eigen::Vector2d span =
      (high - low).cwiseQuotient(Eigen::Vector2d(pattern.width, pattern.height));
  const double share = coverageOf(corners, pattern).share();
  if (span.x() >= kSmallestAcross && span.y() >= kSmallestDown && share >= kSmallestShare) return;
  std::string where;
  for (const std::string& side : emptySides(corners, pattern)) {
    where += (where.empty() ? "nothing was seen in the " : ", the ") + side + " third";
  }
  reasons.push_back(
      fmt::format("the views cover {:.0f} % of the projector's picture ({:.0f} % across, {:.0f} % "
                  "down): {}",
                  100 * share, 100 * span.x(), 100 * span.y(),
                  where.empty() ? "hold the board all over the light"
                                : where + ": hold the board there too"));
}

}  // namespace

std::vector<std::string> viewRefusals(const std::vector<PosedView>& views, const Board& board,
                                      const Pattern& pattern) {
  std::vector<std::string> reasons;
  judgePoses(views, reasons);
  judgeDistance(views, board, reasons);
  if (views.size() >= kFewestViews) judgeCorners(views, pattern, reasons);
  return reasons;
}

}  // namespace afterglow::calib
