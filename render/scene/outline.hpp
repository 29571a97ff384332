/// \file
/// Closed polygons in a plane.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace afterglow::render {

/// Returns true if the point lies inside by the even-odd rule.
inline bool isInside(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[i == 0 ? polygon.size() - 1 : i - 1];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y())) inside = !inside;
  }
  return inside;
}

/// More than 0: counterclockwise.
inline double signedArea(const std::vector<Eigen::Vector2d>& polygon) {
  double area = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return area;
}

}  // namespace afterglow::render
