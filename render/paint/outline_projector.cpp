#include "render/paint/outline_projector.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::render {
namespace {

/// Through three points far apart.
void setPlane(const std::vector<OutlinePoint>& points, const std::vector<Corner>& seen,
              Sprite& sprite) {
  const auto from = [&](std::size_t i) {
    return Eigen::Vector2f(seen[i].x - seen[0].x, seen[i].y - seen[0].y);
  };
  const auto area = [&](std::size_t i, std::size_t k) {
    return from(i).x() * from(k).y() - from(i).y() * from(k).x();
  };
  std::size_t b = 0, c = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (from(i).squaredNorm() > from(b).squaredNorm()) b = i;
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (std::abs(area(b, i)) > std::abs(area(b, c))) c = i;
  }
  if (std::abs(area(b, c)) > 1e-3f) {
    const float at_b = points[b].depth - points[0].depth, at_c = points[c].depth - points[0].depth;
    sprite.by_x = (at_b * from(c).y() - at_c * from(b).y()) / area(b, c);
    sprite.by_y = (at_c * from(b).x() - at_b * from(c).x()) / area(b, c);
  }
  sprite.depth = points[0].depth - sprite.by_x * seen[0].x - sprite.by_y * seen[0].y;
  sprite.slack = 1e-6f + 0.75f * (std::abs(sprite.by_x) + std::abs(sprite.by_y));
}

/// Andrew's monotone chain: the lower half from left to right, then the upper one back. Sorts the
/// corners.
void findHull(std::vector<Corner>& corners, std::vector<Corner>& hull) {
  std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
  });
  hull.clear();
  const auto addHalf = [&hull](auto begin, auto end) {
    const std::size_t first = hull.size();
    for (auto it = begin; it != end; ++it) {
      const auto isNoTurn = [&] {
        const Corner &a = hull[hull.size() - 2], &b = hull.back();
        return (b.x - a.x) * (it->y - a.y) <= (b.y - a.y) * (it->x - a.x);
      };
      while (hull.size() >= first + 2 && isNoTurn()) hull.pop_back();
      hull.push_back(*it);
    }
    hull.pop_back();  // the other half begins with it
  };
  addHalf(corners.begin(), corners.end());
  addHalf(corners.rbegin(), corners.rend());
}

Piece append(Sprite sprite, const std::vector<Corner>& corners, float depth, Sprites& out) {
  Piece piece{Piece::Kind::Outlines, sprite.color >> 24 == 255,
              static_cast<std::uint32_t>(out.used), 0, static_cast<double>(depth)};
  if (corners.size() < 3) return piece;
  sprite.first = static_cast<std::uint32_t>(out.used_corners);
  sprite.count = static_cast<std::uint32_t>(corners.size());
  out.makeRoom(1, corners.size());
  std::copy(corners.begin(), corners.end(),
            out.corners.begin() + static_cast<std::ptrdiff_t>(out.used_corners));
  out.used_corners += corners.size();
  out.all[out.used++] = sprite;
  piece.count = 1;
  return piece;
}

}  // namespace

Piece OutlineProjector::projectEdges(const std::vector<OutlinePoint>& points,
                                     const std::vector<std::array<std::uint32_t, 2>>& edges,
                                     std::uint32_t color, Sprites& out) {
  corners_.clear();
  for (const OutlinePoint& point : points) corners_.push_back(seen(point));
  Sprite sprite;
  sprite.outline = PolygonCoverage::Outline::Edges;
  sprite.color = color;
  setPlane(points, corners_, sprite);
  outline_.clear();
  for (const auto& edge : edges) {
    for (const std::uint32_t i : edge) outline_.push_back(corners_[i]);
  }
  return append(sprite, outline_, points.front().depth, out);
}

Piece OutlineProjector::projectHull(const OutlinePoint* points, std::size_t count,
                                    std::uint32_t color, Sprites& out) {
  corners_.clear();
  Sprite sprite;
  sprite.color = color;
  float least = points[0].depth, greatest = least;
  for (std::size_t i = 0; i < count; ++i) {
    corners_.push_back(seen(points[i]));
    sprite.depth += points[i].depth / static_cast<float>(count);
    least = std::min(least, points[i].depth);
    greatest = std::max(greatest, points[i].depth);
  }
  sprite.slack = 1e-6f + (greatest - least) / 2;
  findHull(corners_, outline_);
  return append(sprite, outline_, sprite.depth, out);
}

Corner OutlineProjector::seen(const OutlinePoint& point) const {
  Corner corner;
  lens_.project(point.x, point.y, corner.x, corner.y);
  return {corner.x + 0.5f, corner.y + 0.5f};
}

}  // namespace afterglow::render
