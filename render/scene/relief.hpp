/// \file
/// A surface that is not quite flat: measured heights over its plane.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace afterglow::render {

/// Heights over the z = 0 plane of a surface's frame, meters, on a regular grid of nodes. A cell of
/// four nodes is two triangles, which meet on the diagonal from its first node. A cell with an
/// unknown node is a hole: nothing is known there, nor around the grid. All coordinates are the
/// surface's. Never changes; any thread.
class Relief {
 public:
  /// A triangle of a cell: (0, 0), (1, 0), (1, 1) or (0, 0), (1, 1), (0, 1).
  struct Triangle {
    int column, row;
    bool is_lower;
  };

  /// The first node lies at `origin`, the next ones along x; not a number: unknown. Throws
  /// std::logic_error unless there are at least 2 x 2 and as many heights as nodes.
  Relief(const Eigen::Vector2d& origin, double cell, int columns, int rows,
         std::vector<float> heights);

  double cell() const { return cell_; }
  const Eigen::Vector2d& origin() const { return origin_; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  /// Returns the height of a node; not a number: unknown.
  float node(int column, int row) const { return heights_[index(column, row)]; }
  Eigen::Vector3d place(int column, int row) const {
    return {origin_.x() + cell_ * column, origin_.y() + cell_ * row,
            static_cast<double>(node(column, row))};
  }
  /// Returns true if a cell is no hole.
  bool isKnown(int column, int row) const;
  double knownShare() const;  ///< of the cells
  /// Bounds of the heights of all cells that are known; least > greatest: there are none.
  double least() const { return least_; }
  double greatest() const { return greatest_; }

  /// Returns a point's place in cells from the first node.
  Eigen::Vector2d inCells(const Eigen::Vector2d& p) const { return (p - origin_) / cell_; }
  /// Returns the triangle at a place; absent in a hole and around the grid.
  std::optional<Triangle> triangleAt(const Eigen::Vector2d& in_cells) const;
  /// Mixes the `value(column, row)` of a triangle's nodes linearly.
  template <typename Value>
  static double mixed(const Triangle& t, const Eigen::Vector2d& in_cells, const Value& value) {
    const double x = in_cells.x() - t.column, y = in_cells.y() - t.row;
    const double first = value(t.column, t.row), last = value(t.column + 1, t.row + 1);
    return t.is_lower ? (1 - x) * first + (x - y) * value(t.column + 1, t.row) + y * last
                      : (1 - y) * first + (y - x) * value(t.column, t.row + 1) + x * last;
  }
  std::optional<double> height(const Eigen::Vector2d& p) const;

  /// Returns the place where a descending ray first meets the relief from above. Absent if there is
  /// none, or the ray may have met something in a hole before.
  std::optional<Eigen::Vector3d> firstHit(const Eigen::Vector3d& from,
                                          const Eigen::Vector3d& direction) const;
  /// Returns the least height over the relief of the straight way down to a point, at most `touch`;
  /// less than 0: something is in the way. The last `touch` of the way is not looked at.
  double clearance(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double touch) const;

 private:
  double heightIn(const Triangle& triangle, const Eigen::Vector2d& in_cells) const;
  template <typename Visit>
  void follow(const Eigen::Vector3d& from, const Eigen::Vector3d& way, double highest, double until,
              const Visit& visit) const;

  Eigen::Vector2d origin_;
  double cell_;
  int columns_, rows_;
  std::vector<float> heights_;
  double least_ = std::numeric_limits<double>::infinity();
  double greatest_ = -std::numeric_limits<double>::infinity();
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
