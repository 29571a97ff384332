/// \file
/// A surface that is not quite flat: measured heights over its plane.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

namespace afterglow::render {

/// Heights over the z = 0 plane of a surface's frame, meters, on a regular grid of nodes; bilinear
/// within a cell of four nodes. A cell with an unknown node is a hole: nothing is known there, nor
/// around the grid. All coordinates are the surface's. Never changes; any thread.
class Relief {
 public:
  struct Range {
    float least, greatest;  ///< least > greatest: nothing is known
    bool is_complete;       ///< no hole, and nothing beyond the grid

    bool isEmpty() const { return least > greatest; }
  };

  /// The first node lies at `origin`, the next ones along x; not a number: unknown. Throws
  /// std::logic_error unless there are at least 2 x 2 and as many heights as nodes.
  Relief(const Eigen::Vector2d& origin, double cell, int columns, int rows,
         std::vector<float> heights);

  double cell() const { return cell_; }
  const Eigen::Vector2d& origin() const { return origin_; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  /// Not a number: unknown.
  float node(int column, int row) const;
  double knownShare() const;  ///< of the cells

  std::optional<double> height(const Eigen::Vector2d& p) const;
  /// A place of a cell, `share` of its sides from its first node; where cells meet, bit for bit the
  /// same of each. Not finite: the cell is a hole.
  Eigen::Vector3d spot(int column, int row, const Eigen::Vector2d& share) const;
  /// Bounds of all heights in a rectangle.
  Range range(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const;
  const Range& range() const { return levels_.back().cells.front(); }
  /// Of a cell; empty: a hole.
  const Range& cellRange(int column, int row) const;
  /// Where a descending ray first meets it from above. Absent if it does not, or may have met
  /// something in a hole before.
  std::optional<Eigen::Vector3d> firstHit(const Eigen::Vector3d& from,
                                          const Eigen::Vector3d& direction) const;
  /// Whether it is known to stop a descending ray on its way to a point, more than `touch` before
  /// it.
  bool isInTheWay(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double touch) const;

 private:
  struct Level {
    int columns = 0, rows = 0;
    std::vector<Range> cells;
  };
  struct Step;

  void addLevels();
  std::optional<double> firstStop(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                                  double until, bool& is_lost) const;
  bool passOver(Step& step) const;
  double heightInCell(int column, int row, const Eigen::Vector2d& grid) const;
  std::optional<double> hitInCell(const Step& step, bool was_above, bool& is_lost) const;

  Eigen::Vector2d origin_;
  double cell_;
  int columns_, rows_;
  std::vector<float> heights_;
  std::vector<Level> levels_;  ///< each with half the cells of the one before, down to one
};

struct ReliefOptions {
  double cell = 0.01;                   ///< meters
  double least = -0.5, greatest = 0.5;  ///< heights that count, meters
};

/// The median of the points in each cell's worth around a node; nodes outside the outline (empty:
/// unbounded) and without points are unknown. Points in the surface's frame. Throws
/// std::runtime_error: no points there, or more cells than a relief may have.
Relief reliefFromPoints(const std::vector<Eigen::Vector3d>& points,
                        const std::vector<Eigen::Vector2d>& polygon, const ReliefOptions& options);

}  // namespace afterglow::render
