#include "calib/solver/refusals.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "calib/number_text.hpp"

// Before solving: whether the views together can calibrate a projector.

namespace afterglow::calib {
namespace {

/// Bounds for an image 1280 px wide.
constexpr double kLargestError_px = 2, kLargestMisfit_px = 1, kReferenceWidth_px = 1280;
constexpr double kLargestAspectError = 0.015, kLargestSkew = 0.5 / kDegrees;
/// Principal point, in pictures from the picture's middle: the largest lens shift there is.
constexpr double kLargestShift = 1.5;
constexpr double kLargestFold = 0.05;
constexpr double kLargestPrintError = 0.002;
/// Printers do not stretch that much one way only.
constexpr double kNoPrinter = 0.02;
/// Half axis of a 95 % ellipse in standard deviations: chi-square with two degrees of freedom.
const double kEllipse95 = std::sqrt(5.991);

/// Returns where light through a projector pixel meets the view's board, in the camera frame; or
/// empty.
std::optional<Eigen::Vector3d> meetingPoint(const ProjectorEstimate& estimate,
                                            const PosedView& view, const Eigen::Vector2d& pixel) {
  const auto ray = unproject(estimate.projector, pixel);
  if (!ray) return std::nullopt;
  const Eigen::Isometry3d& T = estimate.T_camera_projector.matrix();
  const Eigen::Vector3d direction = T.linear() * *ray;
  const Eigen::Vector3d to_board = view.T_camera_board.matrix().translation() - T.translation();
  const double distance = view.normal().dot(to_board) / view.normal().dot(direction);
  if (!(distance > 0)) return std::nullopt;
  return Eigen::Vector3d(T.translation() + distance * direction);
}

double high95(std::vector<double>& values) {
  const auto high = values.begin() + std::ptrdiff_t((values.size() - 1) * 95 / 100);
  std::nth_element(values.begin(), high, values.end());
  return *high;
}

double scaledLimit_px(double limit_px, const Lens& projector) {
  return limit_px * std::max(1.0, projector.width / kReferenceWidth_px);
}

constexpr std::size_t kFewestViews = 3;
/// Largest angle between two boards' normals that leaves focal length and distance apart.
constexpr double kSmallestTilt_deg = 10;
constexpr double kNearest_m = 0.1, kFarthest_m = 15;
constexpr std::size_t kFewestCorners = 40;
/// Shares of the projector's picture, from the first to the last corner. A camera beside a short
/// throw sees little of the picture's height.
constexpr double kSmallestAcross = 0.4, kSmallestDown = 0.25;
/// The share of the cells of the coverage.
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

/// The axis of the camera, vertical or horizontal, about which no board was tilted yet.
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

/// Share of the picture (0 to 1) that no ray within the lens model's fold reaches.
double foldedShare(const Lens& lens) {
  constexpr int kSteps = 40;
  int folded = 0;
  for (int row = 0; row <= kSteps; ++row) {
    for (int column = 0; column <= kSteps; ++column) {
      const Eigen::Vector2d pixel(double(column) / kSteps * (lens.width - 1),
                                  double(row) / kSteps * (lens.height - 1));
      if (!unproject(lens, pixel)) ++folded;
    }
  }
  return double(folded) / ((kSteps + 1) * (kSteps + 1));
}

}  // namespace

PredictedError predictedError(const ProjectorEstimate& estimate,
                              const std::vector<PosedView>& views) {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  const Rigid<Projector, Camera> T_projector_camera = estimate.T_camera_projector.inverse();
  std::vector<double> px, mm;
  for (const PosedView& view : views) {
    // One corner of each tag is enough.
    for (std::size_t i = 0; i < view.lit_px.size(); i += 4) {
      const auto p_camera = meetingPoint(estimate, view, view.lit_px[i]);
      const auto predicted = p_camera ? predictPixel(estimate, *p_camera) : std::nullopt;
      if (!predicted || !predicted->covariance.allFinite()) {
        px.push_back(kUnknown);
        mm.push_back(kUnknown);
        continue;
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(predicted->covariance);
      px.push_back(kEllipse95 * std::sqrt(std::max(0.0, axes.eigenvalues()[1])));
      const double distance = (T_projector_camera * *p_camera).z();
      mm.push_back(px.back() * 1000 * distance / estimate.projector.K(0, 0));
    }
  }
  if (px.empty()) return {kUnknown, kUnknown};
  return {high95(px), high95(mm)};
}

std::vector<std::string> uncertaintyRefusals(const ProjectorEstimate& estimate,
                                             const std::vector<PosedView>& views) {
  const double error = predictedError(estimate, views).px;
  const double limit = scaledLimit_px(kLargestError_px, estimate.projector);
  if (error <= limit) return {};
  return {
      fmt::format("the views leave the projection uncertain by {:.3g} px (95 %), at most {:.3g} is "
                  "useful: take more views, at other distances and tilts",
                  error, limit)};
}

std::vector<std::string> pixelShapeRefusals(const PixelShape& shape, const Lens& projector) {
  constexpr const char* kAdvice =
      "keystone correction or a resolution that is not the projector's own seems to be switched "
      "on: switch both off and calibrate again (if they are off: is the camera_info this "
      "camera's?)";
  std::vector<std::string> reasons;
  const double stretch = std::abs(std::log(shape.aspect));
  if (stretch > kLargestAspectError && stretch > 4 * shape.aspect_sigma) {
    reasons.push_back(
        fmt::format("the projector's pixels are not square ({:.1f} % {}): {}",
                    100 * (std::exp(stretch) - 1),
                    shape.aspect > 1 ? "higher than wide" : "wider than high", kAdvice));
  }
  const double skew = std::abs(shape.skew_rad);
  if (skew > kLargestSkew && skew > 4 * shape.skew_sigma_rad) {
    reasons.push_back(fmt::format("the projector's pixel columns lean by {:.1f} deg: {}",
                                  skew * kDegrees, kAdvice));
  }
  const Eigen::Vector2d shift((projector.K(0, 2) + 0.5) / projector.width - 0.5,
                              (projector.K(1, 2) + 0.5) / projector.height - 0.5);
  if (shift.cwiseAbs().maxCoeff() > kLargestShift) {
    reasons.push_back(
        fmt::format("the projector's axis is {:.1f} pictures off the middle, more than any lens "
                    "shift: {}",
                    shift.cwiseAbs().maxCoeff(), kAdvice));
  }
  return reasons;
}

std::vector<std::string> misfitRefusals(double held_out_rms_px, const Lens& projector) {
  const double limit = scaledLimit_px(kLargestMisfit_px, projector);
  if (held_out_rms_px <= limit) return {};
  return {
      fmt::format("views that were left out are {:.2f} px off, at most {:.2f} is useful: is the "
                  "board flat and the camera calibrated, is a keystone or corner correction "
                  "switched on, did camera or projector move?",
                  held_out_rms_px, limit)};
}

std::vector<std::string> foldRefusals(const Lens& projector) {
  const double folded = foldedShare(projector);
  if (folded <= kLargestFold) return {};
  return {
      fmt::format("the distortion found folds back inside the picture ({:.0f} % of it cannot be "
                  "reached): hold the board into the picture's corners too, where it is decided",
                  100 * folded)};
}

std::vector<std::string> printRefusals(const Board& board, const std::optional<PrintStretch>& seen,
                                       const std::optional<double>& measured_ruler_m) {
  std::vector<std::string> reasons;
  if (seen && std::abs(seen->stretch) > kLargestPrintError &&
      std::abs(seen->stretch) > 4 * seen->sigma) {
    reasons.push_back(
        fmt::format("the board is printed {:.2f} % too {} for its height: {}",
                    100 * std::abs(seen->stretch), seen->stretch > 0 ? "wide" : "narrow",
                    std::abs(seen->stretch) > kNoPrinter
                        ? "is the layout (board.yaml) another board's?"
                        : "print it without fitting it to the page, or on another printer; "
                          "measure both sides"));
  }
  if (!measured_ruler_m) return reasons;
  if (!(board.ruler_m > 0)) {
    reasons.push_back("a measured ruler is given, and the board's layout has none");
    return reasons;
  }
  const double scale = *measured_ruler_m / board.ruler_m;
  if (std::abs(scale - 1) <= kLargestPrintError) return reasons;
  if (!(scale > 0.5 && scale < 2)) {
    reasons.push_back(
        fmt::format("the measured ruler is {:.6g} mm long and the layout's {:.6g} mm: is its "
                    "length given in another unit, or the layout another board's?",
                    1000 * *measured_ruler_m, 1000 * board.ruler_m));
    return reasons;
  }
  reasons.push_back(
      fmt::format("the board is printed at {:.2f} % of its size (its ruler measures {:.2f} mm, "
                  "not {:.2f} mm): print it at 100 %, \"actual size\", not fitted to the page",
                  100 * scale, 1000 * *measured_ruler_m, 1000 * board.ruler_m));
  return reasons;
}

std::vector<std::string> viewRefusals(const std::vector<PosedView>& views, const Board& board,
                                      const Pattern& pattern) {
  std::vector<std::string> reasons;
  judgePoses(views, reasons);
  judgeDistance(views, board, reasons);
  if (views.size() >= kFewestViews) judgeCorners(views, pattern, reasons);
  return reasons;
}

std::vector<std::string> refiningRefusals(const std::vector<PosedView>& views,
                                          const Board& board) {
  std::vector<std::string> reasons;
  judgePoses(views, reasons);
  judgeDistance(views, board, reasons);
  return reasons;
}

std::vector<std::string> driftRefusals(const Lens& before, const Lens& now) {
  constexpr double kDeviations = 4;
  const double focal = std::sqrt(now.K(0, 0) * now.K(1, 1) / (before.K(0, 0) * before.K(1, 1))) - 1;
  const Eigen::Vector2d center = (now.K - before.K).col(2).head<2>();
  if (std::abs(focal) < kDeviations * LensDrift::kFocal &&
      center.norm() < kDeviations * LensDrift::kCenter * now.width) {
    return {};
  }
  return {fmt::format("the projector's lens is not that of the calibration to start from (focal "
                      "length {:+.1f} %, center by ({:+.0f}, {:+.0f}) px): zoom, focus or lens "
                      "shift were touched; take 16 views, and calibrate without that start",
                      100 * focal, center.x(), center.y())};
}

namespace {

constexpr double kSmallestCovered = 0.15;
constexpr int kColumns = Coverage::kColumns, kRows = Coverage::kRows;

/// Along the projector's axis, m.
double middleDistance(const ProjectorEstimate& estimate, const std::vector<PosedView>& views) {
  std::vector<double> distances;
  for (const PosedView& view : views) {
    const Eigen::Vector3d middle = view.T_camera_board.matrix().translation();
    distances.push_back((estimate.T_camera_projector.inverse() * middle).z());
  }
  const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

bool isInReach(const ProjectorEstimate& estimate, const Lens& camera, double distance_m,
               const Eigen::Vector2d& projector_px) {
  const auto ray = unproject(estimate.projector, projector_px);
  if (!ray) return false;
  const auto seen = project(camera, estimate.T_camera_projector * (*ray * distance_m));
  return seen && seen->minCoeff() > 0 && seen->x() < camera.width - 1 &&
         seen->y() < camera.height - 1;
}

struct Cell {
  int column, row;
  bool is_covered;
};

/// Returns for each cell whether it has a corner.
std::vector<bool> cellsOf(const std::vector<Eigen::Vector2d>& corners, const Pattern& pattern) {
  std::vector<bool> cells;
  for (int count : coverageOf(corners, pattern).corners) cells.push_back(count > 0);
  return cells;
}

std::vector<Cell> cellsInReach(const ProjectorEstimate& estimate, const Lens& camera,
                               const Pattern& pattern, const std::vector<PosedView>& views) {
  std::vector<Eigen::Vector2d> lit, all;
  for (const PosedView& view : views) {
    lit.insert(lit.end(), view.lit_px.begin(), view.lit_px.end());
  }
  for (const Tag& tag : pattern.tags) all.insert(all.end(), tag.corners.begin(), tag.corners.end());
  const std::vector<bool> covered = cellsOf(lit, pattern), possible = cellsOf(all, pattern);
  const Eigen::Vector2d cell_px(double(pattern.width) / kColumns, double(pattern.height) / kRows);
  const double distance = middleDistance(estimate, views);
  std::vector<Cell> cells;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const auto index = static_cast<std::size_t>(row * kColumns + column);
      const Eigen::Vector2d middle((column + 0.5) * cell_px.x() - 0.5,
                                   (row + 0.5) * cell_px.y() - 0.5);
      if (covered[index] || (possible[index] && isInReach(estimate, camera, distance, middle))) {
        cells.push_back({column, row, covered[index]});
      }
    }
  }
  return cells;
}

std::vector<std::string> emptySides(const std::vector<Cell>& cells) {
  int left = kColumns, right = -1, top = kRows, bottom = -1;
  for (const Cell& cell : cells) {
    left = std::min(left, cell.column);
    right = std::max(right, cell.column);
    top = std::min(top, cell.row);
    bottom = std::max(bottom, cell.row);
  }
  const double across = (right - left + 1) / 3.0, down = (bottom - top + 1) / 3.0;
  bool has_left = false, has_right = false, has_upper = false, has_lower = false;
  for (const Cell& cell : cells) {
    if (!cell.is_covered) continue;
    has_left = has_left || cell.column + 0.5 < left + across;
    has_right = has_right || cell.column + 0.5 > right + 1 - across;
    has_upper = has_upper || cell.row + 0.5 < top + down;
    has_lower = has_lower || cell.row + 0.5 > bottom + 1 - down;
  }
  std::vector<std::string> sides;
  if (!has_left) sides.push_back("left");
  if (!has_right) sides.push_back("right");
  if (!has_upper) sides.push_back("upper");
  if (!has_lower) sides.push_back("lower");
  return sides;
}

}  // namespace

Reach reachOf(const ProjectorEstimate& estimate, const Lens& camera, const Pattern& pattern,
              const std::vector<PosedView>& views) {
  Reach reach;
  if (views.empty()) return reach;
  const std::vector<Cell> cells = cellsInReach(estimate, camera, pattern, views);
  if (cells.empty()) return reach;
  const auto covered =
      std::count_if(cells.begin(), cells.end(), [](const Cell& cell) { return cell.is_covered; });
  reach.covered = double(covered) / double(cells.size());
  reach.empty_sides = emptySides(cells);
  return reach;
}

std::vector<std::string> reachRefusals(const Reach& reach) {
  if (reach.covered >= kSmallestCovered) return {};
  return {
      fmt::format("the boards cover {:.0f} % of what the camera sees of the projector's picture, "
                  "at least {:.0f} % are needed: hold the board all over the light",
                  100 * reach.covered, 100 * kSmallestCovered)};
}

std::vector<std::string> reachWarnings(const Reach& reach) {
  std::vector<std::string> warnings;
  for (const std::string& side : reach.empty_sides) {
    warnings.push_back("nothing was seen in the " + side +
                       " third of what the camera sees of the projector's picture: hold the board "
                       "there too, or do not trust what is projected there");
  }
  return warnings;
}

}  // namespace afterglow::calib
