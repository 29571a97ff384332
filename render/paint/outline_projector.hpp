/// \file
/// Small solids as one outline on the image each, instead of dozens of triangles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/paint/sprites.hpp"

namespace afterglow::render {

/// A point in normalized coordinates; depth as LightVertex::depth.
struct OutlinePoint {
  float x, y, depth;
};

/// All points lie in front of the lens. Keeps its buffers between calls.
class OutlineProjector {
 public:
  explicit OutlineProjector(const calib::Lens& lens) : lens_(lens) {}

  /// Appends the convex hull of points, as deep as their mean.
  Piece projectHull(const OutlinePoint* points, std::size_t count, std::uint32_t color,
                    Sprites& out);

 private:
  FloatLens lens_;
  std::vector<Corner> corners_, outline_;
};

}  // namespace afterglow::render
