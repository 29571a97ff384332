#include "render/paint/sprites.hpp"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "render/paint/float_lens.hpp"
#include "render/paint/screen_point.hpp"
#include "render/paint/vector_clones.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {
namespace {

using Eigen::Vector3f, Eigen::Vector4f;

constexpr std::size_t kMostCorners = 16;
constexpr std::size_t kBallCorners = 16;  // the largest's outline is a sixth of a pixel off at most

/// Returns corners on a circle of radius 1, widened so that the polygon has its area.
const std::array<Eigen::Vector2f, kBallCorners>& ballCorners() {
  static const std::array<Eigen::Vector2f, kBallCorners> corners = [] {
    std::array<Eigen::Vector2f, kBallCorners> all;
    const double angle = 2 * M_PI / kBallCorners, wide = std::sqrt(angle / std::sin(angle));
    for (std::size_t i = 0; i < kBallCorners; ++i) {
      const double at = angle * static_cast<double>(i);
      all[i] = (wide * Eigen::Vector2d(std::cos(at), std::sin(at))).cast<float>();
    }
    return all;
  }();
  return corners;
}

/// Corners of the outline of a box as seen from one of the 27 regions around it, by whether the eye
/// lies before, between or behind the two faces of each axis. Bit i of a corner: the far end of
/// axis i.
using CornerOrder = std::array<std::uint8_t, kMostCorners>;
struct BoxOutline {
  int count = 0;
  CornerOrder corners{};
};
constexpr CornerOrder kInOrder = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
constexpr CornerOrder kAroundSquare = {0, 1, 3, 2};

/// Edges of the faces that are seen, without those that two of them share.
BoxOutline outlineFrom(const std::array<int, 3>& side) {
  std::array<int, 8> next;
  next.fill(-1);
  std::array<std::array<bool, 8>, 8> has{};
  for (int axis = 0; axis < 3; ++axis) {
    if (side[static_cast<std::size_t>(axis)] == 0) continue;
    const bool far = side[static_cast<std::size_t>(axis)] > 0;
    const int b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3, base = far ? 1 << axis : 0;
    // Counterclockwise from outside.
    std::array<int, 4> face = {base, base | b, base | b | c, base | c};
    if (!far) std::swap(face[1], face[3]);
    for (std::size_t i = 0; i < 4; ++i) {
      has[static_cast<std::size_t>(face[i])][static_cast<std::size_t>(face[(i + 1) % 4])] = true;
    }
  }
  int start = -1;
  for (std::size_t a = 0; a < 8; ++a) {
    for (std::size_t b = 0; b < 8; ++b) {
      if (!has[a][b] || has[b][a]) continue;
      next[a] = static_cast<int>(b);
      start = static_cast<int>(a);
    }
  }
  BoxOutline outline;
  if (start < 0) return outline;
  int at = start;
  do {
    outline.corners[static_cast<std::size_t>(outline.count++)] = static_cast<std::uint8_t>(at);
    at = next[static_cast<std::size_t>(at)];
  } while (at != start && outline.count < 6);
  return outline;
}

/// Region 9 (x + 1) + 3 (y + 1) + z + 1, each side being -1, 0 or 1. Without corners from within.
const BoxOutline& outlineOfBox(std::size_t region) {
  static const std::array<BoxOutline, 27> outlines = [] {
    std::array<BoxOutline, 27> all;
    for (int i = 0; i < 27; ++i) {
      all[static_cast<std::size_t>(i)] = outlineFrom({i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1});
    }
    return all;
  }();
  return outlines[region];
}

/// A worker's part.
struct Part {
  std::size_t begin = 0, end = 0;
  std::size_t count = 0;
  double depth_sum = 0;
  bool is_opaque = true, is_too_large = false;
};

/// Corners before the lens: P_optical_cloud times each, or the differences to that of the center.
struct LensPoints {
  std::array<float, kMostCorners> x, y, z, w;

  void set(std::size_t i, const Vector4f& q) {
    x[i] = q.x();
    y[i] = q.y();
    z[i] = q.z();
    w[i] = q.w();
  }
};

/// Corners on the image; those that are not shown mean nothing.
struct SeenCorners {
  std::array<float, kMostCorners> x, y;
  std::array<std::int32_t, kMostCorners> is_shown;
};

class PartProjector {
 public:
  PartProjector(const FloatLens& lens, int width, int height, const SpriteList& list,
                const Color& color, const PointPlacement& placement, const Vector3f& origin,
                std::size_t stride)
      : lens_(lens),
        width_(static_cast<float>(width)),
        height_(static_cast<float>(height)),
        points_(*list.points),
        list_(list),
        color_(color),
        shape_(list.shape),
        placement_(placement.from(origin)),
        stride_(stride),
        origin_(origin),
        P_(placement_.P_optical_cloud.cast<float>()),
        height_row_(placement_.height.transpose().cast<float>()) {
    const bool is_square = shape_.kind == SpriteShape::Kind::Square;
    for (int corner = 0; corner < (is_square ? 4 : 8); ++corner) {
      const auto side = [&](int axis) { return (corner >> axis & 1) != 0 ? 1.f : -1.f; };
      const Vector3f signs(side(0), side(1), side(2));
      const Vector3f offset = is_square ? Vector3f(signs.x() * shape_.right * shape_.half.x() +
                                                   signs.y() * shape_.up * shape_.half.y())
                                        : Vector3f(signs.cwiseProduct(shape_.half));
      offsets_.set(static_cast<std::size_t>(corner), P_.leftCols<3>() * offset);
    }
  }

  AFTERGLOW_VECTOR_CLONES
  void project(Part& part, Sprite* sprites, std::size_t first_corner, Corner* corners) const {
    lens_.is_fisheye ? projectThrough<true>(part, sprites, first_corner, corners)
                     : projectThrough<false>(part, sprites, first_corner, corners);
  }

 private:
  template <bool kFisheye>
  AFTERGLOW_ALWAYS_INLINE void projectThrough(Part& part, Sprite* sprites, std::size_t first_corner,
                                              Corner* corners) const {
    for (std::size_t i = part.begin; i < part.end; ++i) {
      if (!points_[i].allFinite()) continue;
      const std::uint32_t color = colorOf(i);
      if (color >> 24 == 0) continue;
      Sprite& sprite = sprites[part.count];
      const std::size_t at = part.count * stride_;
      if (!place<kFisheye>(points_[i] - origin_, corners + at, sprite, part)) continue;
      sprite.first = static_cast<std::uint32_t>(first_corner + at);
      sprite.color = color;
      part.is_opaque = part.is_opaque && color >> 24 == 255;
      part.depth_sum += static_cast<double>(sprite.depth);
      ++part.count;
    }
  }

  std::uint32_t colorOf(std::size_t i) const {
    if (list_.colors != nullptr && i < list_.colors->size()) {
      return packedColor((*list_.colors)[i], color_.a, placement_.gain);
    }
    if (list_.byte_colors != nullptr && i < list_.byte_colors->size()) {
      return packedColor((*list_.byte_colors)[i], color_.a, placement_.gain);
    }
    return packedColor(color_, 1, placement_.gain);
  }

  /// A loop without branches over arrays: it becomes vector code.
  template <bool kFisheye, std::size_t kCount>
  AFTERGLOW_ALWAYS_INLINE void throughLens(const Vector4f& center, const LensPoints& offsets,
                                           SeenCorners& seen) const {
    const FloatLens lens = lens_;
    const float qx = center.x(), qy = center.y(), qz = center.z(), qw = center.w();
    for (std::size_t i = 0; i < kCount; ++i) {
      const float z = qz + offsets.z[i], w = qw + offsets.w[i], inverse = 1 / z;
      const float x = (qx + offsets.x[i]) * inverse, y = (qy + offsets.y[i]) * inverse;
      seen.is_shown[i] = (w > 0) & (z >= static_cast<float>(LensDomain::kNear) * w) &
                         (x * x + y * y <= lens.square_fold);
      float u, v;
      lens.project<kFisheye>(x, y, u, v);
      seen.x[i] = u + 0.5f;
      seen.y[i] = v + 0.5f;
    }
  }

  template <bool kFisheye>
  AFTERGLOW_ALWAYS_INLINE bool place(const Vector3f& p, Corner* corners, Sprite& sprite,
                                     Part& part) const {
    const Vector4f q = P_ * p.homogeneous();
    if (!(q.w() > 0 && q.z() >= static_cast<float>(LensDomain::kNear) * q.w())) return false;
    SeenCorners seen;
    const CornerOrder* order = &kInOrder;
    switch (shape_.kind) {
      case SpriteShape::Kind::Square:
        sprite.count = 4;
        order = &kAroundSquare;
        throughLens<kFisheye, 4>(q, offsets_, seen);
        break;
      case SpriteShape::Kind::Box: {
        const BoxOutline& outline = outlineOfBox(regionOf(p));
        sprite.count = static_cast<std::uint32_t>(outline.count);
        order = &outline.corners;
        throughLens<kFisheye, 8>(q, offsets_, seen);
        break;
      }
      case SpriteShape::Kind::Ball: {
        LensPoints circle;
        sprite.count = setCircle(p, circle) ? kBallCorners : 0;
        throughLens<kFisheye, kBallCorners>(q, circle, seen);
        break;
      }
    }
    if (sprite.count == 0) return false;  // the eye is within
    float left = 1e9f, right = -1e9f, top = 1e9f, bottom = -1e9f;
    for (std::uint32_t i = 0; i < sprite.count; ++i) {
      const std::size_t at = (*order)[i];
      if (!seen.is_shown[at]) return false;
      corners[i] = {seen.x[at], seen.y[at]};
      left = std::min(left, seen.x[at]);
      right = std::max(right, seen.x[at]);
      top = std::min(top, seen.y[at]);
      bottom = std::max(bottom, seen.y[at]);
    }
    corners[sprite.count] = corners[0];
    if (right <= 0 || bottom <= 0 || left >= width_ || top >= height_) return false;
    const float largest = std::max(right - left, bottom - top);
    const bool is_square = shape_.kind == SpriteShape::Kind::Square;
    part.is_too_large = part.is_too_large || largest > (is_square ? kLargestSquare : kLargestBody);
    sprite.top = top;
    sprite.bottom = bottom;
    setDepth(p, q, sprite);
    return true;
  }

  /// Sets the depth as LightVertex::depth; its slack is what half a sprite's size makes.
  void setDepth(const Vector3f& p, const Vector4f& q, Sprite& sprite) const {
    const float size = shape_.half.maxCoeff();
    if (placement_.flattened) {
      const float h = height_row_.dot(p.homogeneous());
      sprite.depth = -h / (1 + std::abs(h));
      sprite.slack = 1e-6f;
    } else {
      const float z = q.z() / q.w();
      constexpr auto kScale = static_cast<float>(2 * LensDomain::kNear);
      sprite.depth = 1 - kScale / z;
      sprite.slack = kScale * size / (z * z);
    }
  }

  Vector3f towardEye(const Vector3f& p) const {
    return shape_.eye_is_direction ? shape_.eye : Vector3f(shape_.eye - origin_ - p);
  }

  std::size_t regionOf(const Vector3f& p) const {
    const Vector3f eye = towardEye(p);
    std::size_t region = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float face = shape_.eye_is_direction ? 0 : shape_.half[axis];
      const int side = (eye[axis] > face) - (eye[axis] < -face);
      region = 3 * region + static_cast<std::size_t>(side + 1);
    }
    return region;
  }

  /// The circle where lines of sight touch the ball; an ellipsoid is a ball in its own scale.
  /// Returns false if the eye is within.
  bool setCircle(const Vector3f& p, LensPoints& circle) const {
    const Vector3f eye = towardEye(p).cwiseQuotient(shape_.half);
    const float distance = eye.norm();
    const float middle = shape_.eye_is_direction ? 0 : 1 / distance;
    if (!(middle < 1)) return false;
    const float radius = std::sqrt(1 - middle * middle);
    const Vector3f n = eye / distance, x = n.unitOrthogonal() * radius, y = n.cross(x);
    const auto seen = [this](const Vector3f& unit) -> Vector4f {
      return P_.leftCols<3>() * unit.cwiseProduct(shape_.half);
    };
    const Vector4f q_middle = seen(n * middle), q_x = seen(x), q_y = seen(y);
    for (std::size_t i = 0; i < kBallCorners; ++i) {
      const Eigen::Vector2f& at = ballCorners()[i];
      circle.set(i, q_middle + q_x * at.x() + q_y * at.y());
    }
    return true;
  }

  const FloatLens lens_;
  const float width_, height_;
  const PointList& points_;
  const SpriteList& list_;
  const Color color_;
  const SpriteShape& shape_;
  const PointPlacement placement_;
  const std::size_t stride_;
  const Vector3f origin_;  ///< floats are differences to it
  const Eigen::Matrix4f P_;
  const Eigen::RowVector4f height_row_;
  LensPoints offsets_{};  ///< a square's or box's corners; bit i: the far end of axis i
};

/// Corners that are kept for each.
std::size_t strideOf(const SpriteShape& shape) {
  switch (shape.kind) {
    case SpriteShape::Kind::Square:
      return 4 + 1;
    case SpriteShape::Kind::Box:
      return 6 + 1;
    case SpriteShape::Kind::Ball:
      return kBallCorners + 1;
  }
  return 0;
}

}  // namespace

void Sprites::makeRoom(std::size_t more, std::size_t more_corners) {
  if (all.size() < used + more) all.resize(used + used / 2 + more);
  if (corners.size() < used_corners + more_corners + kCornersMore) {
    corners.resize(used_corners + used_corners / 2 + more_corners + kCornersMore);
  }
}

void Sprites::add(Sprite sprite, const std::vector<Corner>& outline) {
  makeRoom(1, outline.size() + 1);
  const auto [top, bottom] = std::minmax_element(
      outline.begin(), outline.end(), [](const Corner& a, const Corner& b) { return a.y < b.y; });
  sprite.top = top->y;
  sprite.bottom = bottom->y;
  sprite.first = static_cast<std::uint32_t>(used_corners);
  sprite.count = static_cast<std::uint32_t>(outline.size());
  all[used++] = sprite;
  *std::copy(outline.begin(), outline.end(), corners.data() + used_corners) = outline[0];
  used_corners += outline.size() + 1;
}

void Sprites::append(const Sprites& other, std::size_t begin, std::size_t end,
                     std::size_t corners_begin, std::size_t corners_end) {
  makeRoom(end - begin, corners_end - corners_begin);
  for (std::size_t i = begin; i < end; ++i) {
    Sprite& sprite = all[used++] = other.all[i];
    sprite.first += static_cast<std::uint32_t>(used_corners - corners_begin);
  }
  std::copy(other.corners.data() + corners_begin, other.corners.data() + corners_end,
            corners.data() + used_corners);
  used_corners += corners_end - corners_begin;
}

std::optional<Piece> SpriteProjector::project(const SpriteList& list, const Color& color,
                                              const PointPlacement& placement, Workers& workers,
                                              Sprites& out) const {
  Piece piece{Piece::Kind::Outlines, true, static_cast<std::uint32_t>(out.used), 0, 0};
  const PointList& points = *list.points;
  const auto origin =
      std::find_if(points.begin(), points.end(), [](const auto& p) { return p.allFinite(); });
  if (origin == points.end() || !placement.P_optical_cloud.allFinite()) return piece;
  const std::size_t stride = strideOf(list.shape), total = points.size();
  out.makeRoom(total, stride * total);
  std::vector<Part> parts(static_cast<std::size_t>(workers.sharers(total)));
  workers.share(total, [&](int worker, std::size_t begin, std::size_t end) {
    Part& part = parts[static_cast<std::size_t>(worker)];
    part.begin = begin;
    part.end = end;
    const std::size_t first_corner = out.used_corners + stride * begin;
    Sprite* sprites = out.all.data() + out.used + begin;
    Corner* corners = out.corners.data() + first_corner;
    PartProjector(lens_, width_, height_, list, color, placement, *origin, stride)
        .project(part, sprites, first_corner, corners);
  });
  double depth_sum = 0;
  for (const Part& part : parts) {
    if (part.is_too_large) return std::nullopt;
    // Closes the gap between the parts; corners stay where they are.
    const Sprite* from = out.all.data() + piece.first + part.begin;
    Sprite* to = out.all.data() + piece.first + piece.count;
    if (from != to) std::copy(from, from + part.count, to);
    piece.count += static_cast<std::uint32_t>(part.count);
    piece.is_opaque = piece.is_opaque && part.is_opaque;
    depth_sum += part.depth_sum;
  }
  out.used += piece.count;
  out.used_corners += stride * total;
  piece.mean_depth = depth_sum / std::max(1.0, static_cast<double>(piece.count));
  return piece;
}

}  // namespace afterglow::render
