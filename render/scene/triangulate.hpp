/// \file
/// Closed polygons in a plane; outlines with holes into triangles that share their points and no
/// others.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "calib/landing.hpp"

namespace afterglow::render {

using calib::isInside;

/// More than 0: counterclockwise.
inline double signedArea(const std::vector<Eigen::Vector2d>& polygon) {
  double area = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return area;
}

using Outline = std::vector<Eigen::Vector2d>;  ///< closed; the last point is not the first again

/// Triangles over `outer` without `holes`, which lie inside it; either may run either way round.
/// Indices count through `outer`, then through the holes in order. Ear clipping: outlines that
/// cross themselves give some triangles, without an error. Pure; throws never.
std::vector<std::array<std::uint32_t, 3>> triangulate(const Outline& outer,
                                                      const std::vector<Outline>& holes);

}  // namespace afterglow::render
