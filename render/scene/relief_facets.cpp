#include "render/scene/relief_facets.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::render {
namespace {

constexpr int kParts = ReliefSight::kParts;
constexpr std::uint8_t kNotYet = 0xff;
constexpr std::uint32_t kUncut = ~std::uint32_t{0}, kPlain = kUncut - 1, kNoIndex = kUncut;
constexpr std::array<ReliefFacets::Triangle, 2> kHalves = {{{0, 1, 2}, {0, 2, 3}}};
/// Content that would be drawn out so many times lies beside something, not on it.
constexpr double kMostStretch = 16;

}  // namespace

Eigen::Vector2d ReliefCast::foot(const Eigen::Vector3d& p, double height) const {
  if (!p_eye) return p.head<2>();
  const double share = (p_eye->z() - height) / (p_eye->z() - p.z());
  return p_eye->head<2>() + (p.head<2>() - p_eye->head<2>()) * share;
}

void ReliefFacets::begin(const std::shared_ptr<const Relief>& relief,
                         const Eigen::Vector3d& p_light, const ReliefCast& cast) {
  const bool is_same = relief_ == relief && light_.isFrom(p_light) && cast_.p_eye == cast.p_eye;
  if (is_same) return;
  relief_ = relief;
  cast_ = cast;
  light_.begin(relief, p_light);
  if (cast.p_eye) eye_.begin(relief, *cast.p_eye);
  const auto cells = static_cast<std::size_t>(relief->columns() - 1) *
                     static_cast<std::size_t>(relief->rows() - 1);
  parts_.assign(cells, kNotYet);
  cells_.assign(cells, kUncut);
  cuts_.clear();
  corners_.clear();
  triangles_.clear();
}

std::size_t ReliefFacets::index(int column, int row) const {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(relief_->columns() - 1) +
         static_cast<std::size_t>(column);
}

ReliefFacets::Cell ReliefFacets::cell(int column, int row) {
  std::uint32_t& state = cells_[index(column, row)];
  if (state == kUncut) {
    if (isPlain(column, row)) {
      state = kPlain;
    } else {
      state = static_cast<std::uint32_t>(cuts_.size());
      cut(column, row);
    }
  }
  if (state == kPlain) {
    plain_ = {relief_->spot(column, row, {0, 0}), relief_->spot(column, row, {1, 0}),
              relief_->spot(column, row, {1, 1}), relief_->spot(column, row, {0, 1})};
    return {plain_.data(), plain_.size(), kHalves.data(), kHalves.size()};
  }
  const Cut& cut = cuts_[state];
  return {corners_.data() + cut.first_corner, cut.corner_count,
          triangles_.data() + cut.first_triangle, cut.triangle_count};
}

ReliefSight::Corners ReliefFacets::seen(int column, int row) {
  const ReliefSight::Corners lit = light_.seen(column, row);
  return cast_.p_eye && lit.any() ? lit & eye_.seen(column, row) : lit;
}

/// So many of a side follow the relief and keep out of what is dark; none: all is dark.
int ReliefFacets::parts(int column, int row) {
  if (column < 0 || row < 0 || column >= relief_->columns() - 1 || row >= relief_->rows() - 1) {
    return 0;
  }
  std::uint8_t& known = parts_[index(column, row)];
  if (known == kNotYet) known = static_cast<std::uint8_t>(findParts(column, row));
  return known;
}

int ReliefFacets::findParts(int column, int row) {
  if (relief_->cellRange(column, row).isEmpty()) return 0;
  const ReliefSight::Corners corners = seen(column, row);
  if (corners.none()) return 0;
  if (!corners.all()) return kParts;
  // Two triangles leave a bilinear surface by a quarter of its twist in the middle.
  const double twist =
      std::abs(relief_->node(column, row) - relief_->node(column + 1, row) -
               relief_->node(column, row + 1) + relief_->node(column + 1, row + 1));
  int parts = 1;
  while (parts < kParts && twist / (4 * parts * parts) > kTolerance) parts *= 2;
  return parts;
}

/// Two triangles, as most are.
bool ReliefFacets::isPlain(int column, int row) {
  if (parts(column, row) != 1) return false;
  const int finest = std::max({parts(column, row - 1), parts(column + 1, row),
                               parts(column, row + 1), parts(column - 1, row)});
  if (finest > 1) return false;
  const auto spot = [&](double x, double y) { return relief_->spot(column, row, {x, y}); };
  const Eigen::Vector3d a = spot(0, 0), b = spot(1, 0), c = spot(1, 1), d = spot(0, 1);
  return !isStretched(a, b, c) && !isStretched(a, c, d);
}

void ReliefFacets::cut(int column, int row) {
  const Cut before = {static_cast<std::uint32_t>(corners_.size()), 0,
                      static_cast<std::uint32_t>(triangles_.size()), 0};
  cuts_.push_back(before);
  const int count = parts(column, row);
  if (count == 0) return;
  const ReliefSight::Corners corners = seen(column, row);
  const auto pieces = [&](int x, int y) { return std::max(1, parts(column + x, row + y) / count); };
  const std::array<int, 4> sides = {pieces(0, -1), pieces(1, 0), pieces(0, 1), pieces(-1, 0)};
  index_of_.fill(kNoIndex);
  const int size = kParts / count, last = kParts - size;
  for (int y = 0; y < kParts; y += size) {
    for (int x = 0; x < kParts; x += size) {
      const auto isSeen = [&](int dx, int dy) {
        return corners[ReliefSight::index(x + dx, y + dy)];
      };
      if (!isSeen(0, 0) || !isSeen(size, 0) || !isSeen(size, size) || !isSeen(0, size)) continue;
      addSquare({column,
                 row,
                 x,
                 y,
                 size,
                 {y == 0 ? sides[0] : 1, x == last ? sides[1] : 1, y == last ? sides[2] : 1,
                  x == 0 ? sides[3] : 1}});
    }
  }
  cuts_.back().corner_count = static_cast<std::uint32_t>(corners_.size()) - before.first_corner;
  cuts_.back().triangle_count =
      static_cast<std::uint32_t>(triangles_.size()) - before.first_triangle;
}

/// With all corners that its neighbors have on its sides.
void ReliefFacets::addSquare(const Square& square) {
  constexpr std::array<std::array<int, 2>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  ring_.clear();
  for (std::size_t side = 0; side < 4; ++side) {
    const auto &from = kCorners[side], &to = kCorners[(side + 1) % 4];
    const int step = square.size / square.pieces[side];
    for (int at = 0; at < square.size; at += step) {
      ring_.push_back(corner(square, square.x + from[0] * square.size + (to[0] - from[0]) * at,
                             square.y + from[1] * square.size + (to[1] - from[1]) * at));
    }
  }
  if (ring_.size() == 4) {
    for (const Triangle& half : kHalves) add({ring_[half[0]], ring_[half[1]], ring_[half[2]]});
    return;
  }
  const Eigen::Vector2d middle(square.x + 0.5 * square.size, square.y + 0.5 * square.size);
  const auto center = static_cast<std::uint32_t>(corners_.size()) - cuts_.back().first_corner;
  corners_.push_back(relief_->spot(square.column, square.row, middle / kParts));
  for (std::size_t i = 0; i < ring_.size(); ++i) {
    add({center, ring_[i], ring_[(i + 1) % ring_.size()]});
  }
}

std::uint32_t ReliefFacets::corner(const Square& square, int x, int y) {
  std::uint32_t& known = index_of_[ReliefSight::index(x, y)];
  if (known == kNoIndex) {
    known = static_cast<std::uint32_t>(corners_.size()) - cuts_.back().first_corner;
    corners_.push_back(
        relief_->spot(square.column, square.row, Eigen::Vector2d(x, y) / double{kParts}));
  }
  return known;
}

void ReliefFacets::add(const Triangle& triangle) {
  const Eigen::Vector3d* corners = corners_.data() + cuts_.back().first_corner;
  if (isStretched(corners[triangle[0]], corners[triangle[1]], corners[triangle[2]])) return;
  triangles_.push_back(triangle);
}

bool ReliefFacets::isStretched(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c) const {
  if (cast_.p_eye && !(std::max({a.z(), b.z(), c.z()}) < cast_.p_eye->z())) return true;
  const double height = static_cast<double>(relief_->range().least);
  const Eigen::Vector2d foot = cast_.foot(a, height);
  const Eigen::Vector2d to_b = cast_.foot(b, height) - foot, to_c = cast_.foot(c, height) - foot;
  const double area = std::abs(to_b.x() * to_c.y() - to_b.y() * to_c.x());
  return (b - a).cross(c - a).norm() > kMostStretch * area;
}

}  // namespace afterglow::render
