#include "render/paint/outline_projector.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/compose/triangle_projector.hpp"

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
  out.add(sprite, outline_);
  piece.count = 1;
  return piece;
}

namespace {

/// A corner of the rectangle around the letters.
struct FrameCorner {
  Corner seen;
  float depth;
};

/// Any two neighbors of a corner, and it, are not on a line.
using Frame = std::array<FrameCorner, 4>;

Eigen::AlignedBox2f boundsOf(const Body& letters) {
  Eigen::AlignedBox2f box;
  for (const Eigen::Vector3f& p : letters.points) box.extend(p.head<2>());
  return box;
}

/// Returns the letters' plane in the world: x, y and its origin.
Eigen::Matrix<double, 4, 3> planeInWorld(const Drawable& drawable, const Eye& eye) {
  const Eigen::Vector3d p_world = drawable.pose.matrix().translation();
  Eigen::Matrix<double, 4, 3> T = Eigen::Matrix<double, 4, 3>::Zero();
  T.topLeftCorner<3, 2>() = axesOfLetters(eye, p_world).leftCols<2>();
  T.col(2) = p_world.homogeneous();
  return T;
}

void setDepth(const Frame& frame, Sprite& sprite) {
  const Corner &a = frame[0].seen, &b = frame[1].seen, &c = frame[3].seen;
  const float bx = b.x - a.x, by = b.y - a.y, cx = c.x - a.x, cy = c.y - a.y;
  const float at_b = frame[1].depth - frame[0].depth, at_c = frame[3].depth - frame[0].depth;
  const float area = bx * cy - by * cx;
  if (std::abs(area) > 1e-3f) {
    sprite.by_x = (at_b * cy - at_c * by) / area;
    sprite.by_y = (at_c * bx - at_b * cx) / area;
  }
  sprite.depth = frame[0].depth - sprite.by_x * a.x - sprite.by_y * a.y;
  sprite.slack = 1e-6f + 0.75f * (std::abs(sprite.by_x) + std::abs(sprite.by_y));
}

}  // namespace

std::optional<Piece> LetterProjector::project(const Body& letters, const Drawable& drawable,
                                              const ComposedLayer& layer, Sprites& out) {
  const Placed& placed = layer.placed;
  const Rgba color = asBytes(asFloats(asBytes(drawable.color), placed.gain));
  Piece piece{Piece::Kind::Outlines, isOpaque(color), static_cast<std::uint32_t>(out.used), 0, 0};
  if (letters.outline.empty()) return std::nullopt;
  if (isInvisible(color)) return piece;
  const PlaneMatrix T_world_letters = planeInWorld(drawable, layer.eye);
  const PlaneMatrix P_optical_letters = placed.P_optical_world * T_world_letters;
  const Eigen::RowVector3d height = placed.height.transpose() * T_world_letters;
  const Eigen::AlignedBox2f box = boundsOf(letters);
  Frame frame;
  Eigen::AlignedBox2d seen;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const Eigen::Vector3d p((i == 1 || i == 2 ? box.max() : box.min()).x(),
                            (i < 2 ? box.min() : box.max()).y(), 1);
    const CutVertex vertex{P_optical_letters * p, Eigen::Vector4f::Zero(), height * p};
    if (!isInside(domain_, vertex)) return std::nullopt;
    seen.extend(normalized(vertex));
    const LightVertex light = lightVertex(vertex, placed);
    frame[i] = {lens_.seen(light.x / light.z, light.y / light.z), light.depth};
  }
  if (!domain_.isStraightWithin(seen.min(), seen.max()) &&
      !areEdgesStraight(letters, P_optical_letters)) {
    return std::nullopt;
  }
  lens_.is_fisheye ? projectPoints<true>(letters, P_optical_letters)
                   : projectPoints<false>(letters, P_optical_letters);
  Sprite sprite;
  sprite.outline = PolygonCoverage::Outline::Edges;
  sprite.color = packedColor(color);
  setDepth(frame, sprite);
  outline_.clear();
  for (const auto& [from, to] : letters.outline) {
    outline_.push_back(seen_[from]);
    outline_.push_back(seen_[to]);
  }
  out.add(sprite, outline_);
  piece.count = 1;
  piece.mean_depth = static_cast<double>((frame[0].depth + frame[2].depth) / 2);
  return piece;
}

bool LetterProjector::areEdgesStraight(const Body& letters,
                                       const PlaneMatrix& P_optical_letters) const {
  const auto at = [&](std::uint32_t i) -> Eigen::Vector2d {
    const Eigen::Vector3d p = letters.points[i].cast<double>().head<2>().homogeneous();
    return (P_optical_letters * p).head<3>().hnormalized();
  };
  return std::all_of(letters.outline.begin(), letters.outline.end(), [&](const auto& edge) {
    return domain_.isStraight(at(edge[0]), at(edge[1]));
  });
}

template <bool kFisheye>
void LetterProjector::projectPoints(const Body& letters, const PlaneMatrix& P_optical_letters) {
  const Eigen::Matrix3f P = P_optical_letters.topRows<3>().cast<float>();
  seen_.resize(letters.points.size());
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const float x = letters.points[i].x(), y = letters.points[i].y();
    const float inverse = 1 / (P(2, 0) * x + P(2, 1) * y + P(2, 2));
    seen_[i] = lens_.seen<kFisheye>((P(0, 0) * x + P(0, 1) * y + P(0, 2)) * inverse,
                                    (P(1, 0) * x + P(1, 1) * y + P(1, 2)) * inverse);
  }
}

}  // namespace afterglow::render
