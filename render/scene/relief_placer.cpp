#include "render/scene/relief_placer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace afterglow::render {
namespace {

constexpr std::uint32_t kNoIndex = ~std::uint32_t{0};
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Content is laid as long as it is lower than this share of the eye's height over the relief.
constexpr double kHighest = 0.999;
/// Content seen along its edge casts nothing: as wide as this share of its length, or less.
constexpr double kSliver = 1e-9;
constexpr double kOnSide = 1e-10;   // meters; nearer to a side is on it
constexpr double kRounding = 1e-6;  // of a cell

bool isBefore(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

bool areWithin(double low, double high, int last, int& first, int& end) {
  if (!(low <= last) || !(high >= 0)) return false;
  first = static_cast<int>(std::max(0.0, low));
  end = static_cast<int>(std::min<double>(last, high)) + 1;
  return true;
}

}  // namespace

void ReliefPlacer::begin(const Layer& layer, const Eigen::Vector3d& p_light) {
  if (!layer.surface || !layer.surface->relief || layer.placement == Placement::Direct) {
    throw std::logic_error("layer " + layer.name + " is not placed on a relief");
  }
  relief_ = layer.surface->relief;
  T_world_surface_ = layer.surface->T_world_surface.matrix();
  const Eigen::Isometry3d T_surface_world = T_world_surface_.inverse();
  p_light_ = T_surface_world * p_light;
  cast_.p_eye.reset();
  if (layer.placement == Placement::Viewer) cast_.p_eye = T_surface_world * layer.p_viewer;
  facets_.begin(relief_, p_light_, cast_);
}

std::optional<Eigen::Vector3d> ReliefPlacer::landing(const Eigen::Vector3d& p) const {
  if (cast_.p_eye) {
    return p.z() < cast_.p_eye->z() ? relief_->firstHit(*cast_.p_eye, p - *cast_.p_eye)
                                    : std::nullopt;
  }
  const auto height = relief_->height(p.head<2>());
  if (!height) return std::nullopt;
  return Eigen::Vector3d(p.x(), p.y(), *height);
}

std::optional<Eigen::Vector3d> ReliefPlacer::spotOf(const Eigen::Vector3d& p) const {
  const auto spot = landing(p);
  return spot && !relief_->isInTheWay(p_light_, *spot, ReliefSight::kTouch) ? spot : std::nullopt;
}

std::optional<Eigen::Vector3d> ReliefPlacer::place(const Eigen::Vector3d& p_world) const {
  const auto spot = spotOf(T_world_surface_.inverse() * p_world);
  if (!spot) return std::nullopt;
  return Eigen::Vector3d(T_world_surface_ * *spot);
}

void ReliefPlacer::lay(const Mesh& mesh, LaidMesh& out) {
  out.mesh.clear();
  out.heights.clear();
  vertices_.clear();
  if (relief_->range().isEmpty()) return;
  if (cast_.p_eye && !(cast_.p_eye->z() > double{relief_->range().least})) return;
  out_ = &out;
  const Eigen::Isometry3d T_surface_world = T_world_surface_.inverse();
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    vertices_.push_back({T_surface_world * mesh.points[i], asFloats(mesh.colors[i])});
  }
  for (const auto& triangle : mesh.triangles) layBelowEye(triangle);
}

double ReliefPlacer::highest() const {
  if (!cast_.p_eye) return kInfinity;
  const double least = static_cast<double>(relief_->range().least);
  return least + kHighest * (cast_.p_eye->z() - least);
}

/// Content as high as the eye or higher has no place below the eye.
void ReliefPlacer::layBelowEye(const std::array<std::uint32_t, 3>& triangle) {
  const double most = highest();
  const auto room = [most](const Vertex& vertex) { return most - vertex.p.z(); };
  std::array<Vertex, 4> kept;
  std::size_t count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vertex &a = vertices_[triangle[i]], &b = vertices_[triangle[(i + 1) % 3]];
    const bool is_below = room(a) >= 0;
    if (is_below) kept[count++] = a;
    if (is_below == (room(b) >= 0)) continue;
    // From the lower end, whichever way round the triangle has it: neighbors agree.
    const Vertex &low = is_below ? a : b, &high = is_below ? b : a;
    const double share = room(low) / (room(low) - room(high));
    const auto weight = static_cast<float>(share);
    kept[count++] = {low.p * (1 - share) + high.p * share,
                     low.color * (1 - weight) + high.color * weight};
  }
  for (std::size_t i = 2; i < count; ++i) layTriangle(kept[0], kept[i - 1], kept[i]);
}

void ReliefPlacer::layTriangle(const Vertex& a, const Vertex& b, const Vertex& c) {
  const Content content{{&a, &b, &c}, {sideOf(b, c, a), sideOf(c, a, b), sideOf(a, b, c)}};
  for (std::size_t i = 0; i < 3; ++i) {
    const Side& side = content.sides[i];
    const Eigen::Vector3d& p = content.corners[i]->p;
    if (!(side.at(p) > kSliver * side.normal.norm() * (p - side.origin).norm())) return;
  }
  findFootprint(content);
  const auto [low, high] = std::minmax_element(
      footprint_.begin(), footprint_.end(),
      [](const Eigen::Vector2d& p, const Eigen::Vector2d& q) { return p.y() < q.y(); });
  int row = 0, row_end = 0;
  if (!areWithin(low->y() - kRounding, high->y() + kRounding, relief_->rows() - 2, row, row_end)) {
    return;
  }
  for (; row < row_end; ++row) {
    const auto [left, right] = columnsIn(row);
    int column = 0, end = 0;
    if (!areWithin(left - kRounding, right + kRounding, relief_->columns() - 2, column, end)) {
      continue;
    }
    for (; column < end; ++column) layOn(facets_.cell(column, row), content);
  }
}

/// From the edge's lesser end: the two triangles that share it get each other's opposite, bit for
/// bit.
ReliefPlacer::Side ReliefPlacer::sideOf(const Vertex& a, const Vertex& b,
                                        const Vertex& opposite) const {
  const bool is_ordered = isBefore(a.p, b.p);
  const Eigen::Vector3d &first = is_ordered ? a.p : b.p, &second = is_ordered ? b.p : a.p;
  Side side{Eigen::Vector3d(first.y() - second.y(), second.x() - first.x(), 0), first, 0};
  if (cast_.p_eye) {
    side.normal = (first - *cast_.p_eye).cross(second - *cast_.p_eye);
    side.origin = *cast_.p_eye;
  }
  side.rounding = kOnSide * side.normal.norm();
  if (side.at(opposite.p) < 0) side.normal = -side.normal;
  return side;
}

void ReliefPlacer::findFootprint(const Content& content) {
  const Relief::Range& range = relief_->range();
  const auto add = [this](const Eigen::Vector2d& foot) {
    footprint_.emplace_back((foot - relief_->origin()) / relief_->cell());
  };
  footprint_.clear();
  for (const Vertex* corner : content.corners) {
    add(cast_.foot(corner->p, static_cast<double>(range.least)));
    if (!cast_.p_eye) continue;
    add(cast_.foot(corner->p, std::min(static_cast<double>(range.greatest), cast_.p_eye->z())));
  }
}

/// From where to where the footprint's hull reaches in a row of cells.
std::array<double, 2> ReliefPlacer::columnsIn(int row) const {
  std::array<double, 2> columns = {kInfinity, -kInfinity};
  const double low = row - kRounding, high = row + 1 + kRounding;
  for (std::size_t i = 0; i < footprint_.size(); ++i) {
    for (std::size_t j = i + 1; j < footprint_.size(); ++j) {
      const Eigen::Vector2d &a = footprint_[i], &b = footprint_[j];
      if (std::max(a.y(), b.y()) < low || std::min(a.y(), b.y()) > high) continue;
      const double height = b.y() - a.y();
      for (const double y : {low, high}) {
        const double share =
            height == 0 ? (y == low ? 0 : 1) : std::clamp((y - a.y()) / height, 0., 1.);
        const double x = a.x() + share * (b.x() - a.x());
        columns = {std::min(columns[0], x), std::max(columns[1], x)};
      }
    }
  }
  return columns;
}

void ReliefPlacer::layOn(const ReliefFacets::Cell& cell, const Content& content) {
  if (cell.triangle_count == 0) return;
  shares_.clear();
  for (std::size_t i = 0; i < cell.corner_count; ++i) {
    shares_.push_back(content.at(cell.corners[i]));
  }
  index_of_.assign(cell.corner_count, kNoIndex);
  for (std::size_t i = 0; i < cell.triangle_count; ++i) {
    const ReliefFacets::Triangle& t = cell.triangles[i];
    const Shares &a = shares_[t[0]], &b = shares_[t[1]], &c = shares_[t[2]];
    bool is_inside = true, is_outside = false;
    for (std::size_t side = 0; side < 3; ++side) {
      is_inside = is_inside && a[side] >= 0 && b[side] >= 0 && c[side] >= 0;
      is_outside = is_outside || (a[side] <= 0 && b[side] <= 0 && c[side] <= 0);
    }
    if (is_outside) continue;
    if (!is_inside) {
      cut({cell.corners[t[0]], cell.corners[t[1]], cell.corners[t[2]]}, content);
      continue;
    }
    for (const std::uint32_t at : t) {
      if (index_of_[at] == kNoIndex) index_of_[at] = add(cell.corners[at], shares_[at], content);
    }
    out_->mesh.triangles.push_back({index_of_[t[0]], index_of_[t[1]], index_of_[t[2]]});
  }
}

/// To the part inside of all sides.
void ReliefPlacer::cut(const Facet& facet, const Content& content) {
  polygon_.clear();
  for (std::size_t i = 0; i < 3; ++i) polygon_.push_back({facet[i], content.at(facet[i]), i});
  for (std::size_t side = 0; side < 3; ++side) cutOff(side, facet, content);
  const auto first = static_cast<std::uint32_t>(out_->mesh.points.size());
  if (polygon_.size() < 3) return;
  for (const Corner& corner : polygon_) add(corner.p, corner.shares, content);
  for (std::uint32_t i = 2; i < polygon_.size(); ++i) {
    out_->mesh.triangles.push_back({first, first + i - 1, first + i});
  }
}

void ReliefPlacer::cutOff(std::size_t side, const Facet& facet, const Content& content) {
  clipped_.clear();
  for (std::size_t i = 0; i < polygon_.size(); ++i) {
    const Corner &a = polygon_[i], &b = polygon_[(i + 1) % polygon_.size()];
    const double at_a = a.shares[side], at_b = b.shares[side];
    if (at_a >= 0) clipped_.push_back(a);
    if (at_a == 0 && at_b < 0) clipped_.back().line = 3 + side;
    if (at_a * at_b >= 0) continue;
    const Eigen::Vector3d p = crossing(a.line, side, facet, content);
    Shares shares = content.at(p);
    shares[side] = 0;
    clipped_.push_back({p, shares, at_a > 0 ? 3 + side : a.line});
  }
  polygon_.swap(clipped_);
}

/// Where a line of the polygon meets a side: found by what lies there, in whichever polygon, so
/// that all that meet there agree to the last bit.
Eigen::Vector3d ReliefPlacer::crossing(std::size_t line, std::size_t side, const Facet& facet,
                                       const Content& content) const {
  if (line >= 3) return landingOn(facet, content.corners[3 - (line - 3) - side]->p);
  const Eigen::Vector3d *from = &facet[line], *to = &facet[(line + 1) % 3];
  if (isBefore(*to, *from)) std::swap(from, to);
  const double at_from = content.sides[side].at(*from), at_to = content.sides[side].at(*to);
  const double share = at_from == at_to ? 0 : std::clamp(at_from / (at_from - at_to), 0.0, 1.0);
  return *from + share * (*to - *from);
}

/// Where content is cast on a facet's plane.
Eigen::Vector3d ReliefPlacer::landingOn(const Facet& facet, const Eigen::Vector3d& p) const {
  const Eigen::Vector3d normal = (facet[1] - facet[0]).cross(facet[2] - facet[0]);
  const Eigen::Vector3d from = cast_.p_eye.value_or(p);
  const Eigen::Vector3d way = cast_.p_eye ? Eigen::Vector3d(p - from) : -Eigen::Vector3d::UnitZ();
  return from + normal.dot(facet[0] - from) / normal.dot(way) * way;
}

/// A vertex of the output.
std::uint32_t ReliefPlacer::add(const Eigen::Vector3d& p, const Shares& shares,
                                const Content& content) {
  const Eigen::Vector3d positive = Eigen::Vector3d(shares[0], shares[1], shares[2]).cwiseMax(0);
  const Eigen::Vector3d weights = positive / positive.sum();
  double height = 0;
  Eigen::Vector4f color = Eigen::Vector4f::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const double weight = weights[static_cast<Eigen::Index>(i)];
    height += weight * content.corners[i]->p.z();
    color += static_cast<float>(weight) * content.corners[i]->color;
  }
  out_->mesh.points.push_back(T_world_surface_ * p);
  out_->mesh.colors.push_back(asBytes(color));
  out_->heights.push_back(height);
  return static_cast<std::uint32_t>(out_->mesh.points.size() - 1);
}

}  // namespace afterglow::render
