/// \file
/// What of a relief a single place sees: a lens that lights it, a viewer's eye.
#pragma once

#include <Eigen/Core>
#include <bitset>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/scene/relief.hpp"

namespace afterglow::render {

/// Looks at a cell when it is first asked for, and remembers it as long as relief and place stay.
class ReliefSight {
 public:
  static constexpr int kParts = 8;  ///< of a cell's side
  /// The corners of a cell's parts, row by row.
  using Corners = std::bitset<(kParts + 1) * (kParts + 1)>;
  static std::size_t index(int x, int y) { return static_cast<std::size_t>(y * (kParts + 1) + x); }

  /// What stops light this near to where it is to land, meters, does not: noise.
  static constexpr double kTouch = 0.01;

  /// Keeps the relief. From in its coordinates.
  void begin(const std::shared_ptr<const Relief>& relief, const Eigen::Vector3d& from);
  bool isFrom(const Eigen::Vector3d& from) const { return from_ == from; }

  /// Those that are seen, of a cell that is known. What is narrower than half a cell may be missed,
  /// in the way and on the ground.
  Corners seen(int column, int row);

 private:
  Corners look(int column, int row) const;
  bool isSurelySeen(int column, int row) const;

  std::shared_ptr<const Relief> relief_;
  Eigen::Vector3d from_ = Eigen::Vector3d::Zero();
  std::vector<std::uint32_t> views_;  ///< by cell, of `looks_`; kNotYet: not looked at
  std::vector<Corners> looks_;        ///< the first two: nothing, all
};

}  // namespace afterglow::render
