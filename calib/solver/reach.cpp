#include "calib/solver/reach.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace afterglow::calib {
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
