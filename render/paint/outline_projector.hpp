/// \file
/// Small solids and letters as one outline on the image each, instead of dozens of triangles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/paint/sprites.hpp"

namespace afterglow::render {

/// In normalized coordinates; depth as LightVertex::depth.
struct OutlinePoint {
  float x, y, depth;
};

/// All points lie in front of the lens. Keeps its buffers between calls.
class OutlineProjector {
 public:
  explicit OutlineProjector(const calib::Lens& lens) : lens_(lens) {}

  /// Appends the outline of something flat that is of one color: `edges` are pairs of `points`.
  Piece projectEdges(const std::vector<OutlinePoint>& points,
                     const std::vector<std::array<std::uint32_t, 2>>& edges, std::uint32_t color,
                     Sprites& out);

  /// Appends the convex hull of points, as deep as their mean.
  Piece projectHull(const OutlinePoint* points, std::size_t count, std::uint32_t color,
                    Sprites& out);

 private:
  Corner seen(const OutlinePoint& point) const;

  FloatLens lens_;
  std::vector<Corner> corners_, outline_;
};

}  // namespace afterglow::render
