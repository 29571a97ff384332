/// \file
/// A relief as triangles: those that a projector's light reaches and a viewer sees.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "render/scene/relief.hpp"
#include "render/scene/relief_sight.hpp"

namespace afterglow::render {

/// How content gets on a relief: along z, or on the rays of an eye. The relief's coordinates.
struct ReliefCast {
  std::optional<Eigen::Vector3d> p_eye;  ///< absent: along z

  /// Where a point is cast on the plane of a height. Of an eye: the point is lower than it.
  Eigen::Vector2d foot(const Eigen::Vector3d& p, double height) const;
};

/// Cuts a cell when it is first asked for, and remembers it as long as relief, light and eye stay:
/// content may move over it.
class ReliefFacets {
 public:
  static constexpr double kTolerance = 0.0005;    ///< meters, off the bilinear surface
  using Triangle = std::array<std::uint32_t, 3>;  ///< of a cell's corners
  struct Cell {
    const Eigen::Vector3d* corners;
    std::size_t corner_count;
    const Triangle* triangles;
    std::size_t triangle_count;
  };

  /// Keeps the relief. All in its coordinates.
  void begin(const std::shared_ptr<const Relief>& relief, const Eigen::Vector3d& p_light,
             const ReliefCast& cast);

  /// Until the next call. Where a part of it only is lit and seen, an eighth of it decides; cells
  /// that meet share the corners between them, bit for bit.
  Cell cell(int column, int row);

 private:
  struct Cut {
    std::uint32_t first_corner, corner_count, first_triangle, triangle_count;
  };
  /// A square part of a cell, in units of ReliefSight::kParts.
  struct Square {
    int column, row;  ///< its cell
    int x, y, size;
    std::array<int, 4> pieces;  ///< of its sides: below, right, above, left
  };

  std::size_t index(int column, int row) const;
  ReliefSight::Corners seen(int column, int row);
  int parts(int column, int row);
  int findParts(int column, int row);
  bool isPlain(int column, int row);
  void cut(int column, int row);
  void addSquare(const Square& square);
  std::uint32_t corner(const Square& square, int x, int y);
  void add(const Triangle& triangle);
  bool isStretched(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                   const Eigen::Vector3d& c) const;

  std::shared_ptr<const Relief> relief_;
  ReliefCast cast_;
  ReliefSight light_, eye_;
  std::vector<std::uint8_t> parts_;   ///< of a side, by cell; kNotYet: not looked at
  std::vector<std::uint32_t> cells_;  ///< by cell, of `cuts_`; kPlain, kUncut
  std::vector<Cut> cuts_;
  std::vector<Eigen::Vector3d> corners_;
  std::vector<Triangle> triangles_;
  std::array<Eigen::Vector3d, 4> plain_;                               ///< the last plain cell's
  std::array<std::uint32_t, ReliefSight::Corners().size()> index_of_;  ///< in the cell being cut
  std::vector<std::uint32_t> ring_;
};

}  // namespace afterglow::render
