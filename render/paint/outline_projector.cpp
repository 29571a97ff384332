#include "render/paint/outline_projector.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::render {
namespace {

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

}  // namespace

Piece OutlineProjector::projectHull(const OutlinePoint* points, std::size_t count,
                                    std::uint32_t color, Sprites& out) {
  corners_.clear();
  Sprite sprite;
  sprite.color = color;
  float least = points[0].depth, greatest = least;
  for (std::size_t i = 0; i < count; ++i) {
    corners_.push_back(lens_.seen(points[i].x, points[i].y));
    sprite.depth += points[i].depth / static_cast<float>(count);
    least = std::min(least, points[i].depth);
    greatest = std::max(greatest, points[i].depth);
  }
  sprite.slack = 1e-6f + (greatest - least) / 2;
  findHull(corners_, outline_);
  Piece piece{Piece::Kind::Outlines, color >> 24 == 255, static_cast<std::uint32_t>(out.used), 0,
              static_cast<double>(sprite.depth)};
  if (outline_.size() < 3) return piece;
  std::copy(outline_.begin(), outline_.end(), out.add(sprite, outline_.size()));
  piece.count = 1;
  return piece;
}

}  // namespace afterglow::render
