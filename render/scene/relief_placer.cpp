#include "render/scene/relief_placer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace afterglow::render {
namespace {

constexpr float kNotYet = std::numeric_limits<float>::quiet_NaN();
/// Content seen along its edge casts nothing: as wide as this share of its length, or less.
constexpr double kSliver = 1e-9;
constexpr double kOnSide = 1e-9;  // a share that is less is on the side
/// Content that would be drawn out so many times lies beside something, not on it.
constexpr double kMostStretch = 16;

bool isBefore(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

}  // namespace

ReliefPlacer::ReliefPlacer(const Layer& layer, const Eigen::Vector3d& p_light)
    : placement_(layer.placement), p_world_light_(p_light), p_world_viewer_(layer.p_viewer) {
  if (!layer.surface || !layer.surface->relief || placement_ == Placement::Direct) {
    throw std::logic_error("layer " + layer.name + " is not placed on a relief");
  }
  relief_ = layer.surface->relief;
  T_world_surface_ = layer.surface->T_world_surface.matrix();
  p_light_ = inSurface(p_light);
  if (placement_ == Placement::Viewer) p_eye_ = inSurface(layer.p_viewer);
  clearances_ = std::vector<std::atomic<float>>(relief_->index(0, relief_->rows()));
  for (std::atomic<float>& clearance : clearances_) clearance = kNotYet;
}

bool ReliefPlacer::isFor(const Layer& layer, const Eigen::Vector3d& p_light) const {
  return layer.surface && layer.surface->relief == relief_ && layer.placement == placement_ &&
         layer.surface->T_world_surface.matrix().matrix() == T_world_surface_.matrix() &&
         p_light == p_world_light_ && (!p_eye_ || layer.p_viewer == p_world_viewer_);
}

Eigen::Vector3d ReliefPlacer::inSurface(const Eigen::Vector3d& p_world) const {
  return T_world_surface_.inverse() * p_world;
}

/// Returns a node's clearance. Threads that ask for a node at the same time find the same.
double ReliefPlacer::clearance(int column, int row) const {
  std::atomic<float>& known = clearances_[relief_->index(column, row)];
  float value = known.load(std::memory_order_relaxed);
  if (std::isnan(value)) {
    const Eigen::Vector3d p = relief_->place(column, row);
    double least = relief_->clearance(p_light_, p, kTouch);
    if (p_eye_ && least > 0) least = std::min(least, relief_->clearance(*p_eye_, p, kTouch));
    value = static_cast<float>(least);
    known.store(value, std::memory_order_relaxed);
  }
  return static_cast<double>(value);
}

std::optional<Eigen::Vector3d> ReliefPlacer::landing(const Eigen::Vector3d& p) const {
  if (p_eye_) {
    return p.z() < p_eye_->z() ? relief_->firstHit(*p_eye_, p - *p_eye_) : std::nullopt;
  }
  const auto height = relief_->height(p.head<2>());
  if (!height) return std::nullopt;
  return Eigen::Vector3d(p.x(), p.y(), *height);
}

std::optional<Eigen::Vector3d> ReliefPlacer::place(const Eigen::Vector3d& p_world) const {
  const auto spot = landing(inSurface(p_world));
  if (!spot) return std::nullopt;
  const Eigen::Vector2d in_cells = relief_->inCells(spot->head<2>());
  const auto triangle = relief_->triangleAt(in_cells);
  const auto clearanceOf = [this](int column, int row) { return clearance(column, row); };
  if (!triangle || Relief::mixed(*triangle, in_cells, clearanceOf) < 0) return std::nullopt;
  return Eigen::Vector3d(T_world_surface_ * *spot);
}

void ReliefPlacer::lay(const Mesh& mesh, LaidMesh& out) const {
  out.mesh.clear();
  out.heights.clear();
  const Eigen::Isometry3d T_surface_world = T_world_surface_.inverse();
  std::vector<Vertex> vertices;
  vertices.reserve(mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    vertices.push_back({T_surface_world * mesh.points[i], asFloats(mesh.colors[i])});
  }
  for (const auto& t : mesh.triangles) {
    const auto content = contentOf({&vertices[t[0]], &vertices[t[1]], &vertices[t[2]]});
    const auto cells = content ? cellsUnder(*content) : std::nullopt;
    if (!cells) continue;
    for (int row = cells->first.y(); row <= cells->last.y(); ++row) {
      for (int column = cells->first.x(); column <= cells->last.x(); ++column) {
        if (relief_->isKnown(column, row)) layOn(column, row, *content, out);
      }
    }
  }
}

/// Returns a triangle with its shares; absent: it is seen along its edge. A place's shares are
/// those with which the corners add up to it, seen from the eye or along z; all that lies before
/// the eye between the corners' rays has none below zero, be the corners as high as the eye or
/// higher.
std::optional<ReliefPlacer::Content> ReliefPlacer::contentOf(
    const std::array<const Vertex*, 3>& corners) const {
  const Eigen::Vector3d &a = corners[0]->p, &b = corners[1]->p, &c = corners[2]->p;
  const Eigen::Vector3d way = p_eye_ ? Eigen::Vector3d(a - *p_eye_) : Eigen::Vector3d::UnitZ();
  const double volume = std::abs(way.dot((b - a).cross(c - a)));
  if (!(volume > kSliver * way.norm() * (b - a).norm() * (c - a).norm())) return std::nullopt;
  Eigen::Matrix3d rays;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Vector3d& p = corners[static_cast<std::size_t>(i)]->p;
    rays.col(i) = p_eye_ ? Eigen::Vector3d(p - *p_eye_) : Eigen::Vector3d(p.x(), p.y(), 1);
  }
  const Eigen::Matrix3d inverse = rays.inverse();
  Content content{corners, {}};
  if (p_eye_) {
    content.shares << inverse, -inverse * *p_eye_;
  } else {
    content.shares << inverse.leftCols<2>(), Eigen::Vector3d::Zero(), inverse.col(2);
  }
  return content;
}

/// Returns the cells that a triangle of the content can be cast on.
std::optional<ReliefPlacer::Cells> ReliefPlacer::cellsUnder(const Content& content) const {
  const Eigen::Array2d end(relief_->columns() - 2, relief_->rows() - 2);
  if (relief_->least() > relief_->greatest()) return std::nullopt;
  Eigen::Array2d low = Eigen::Array2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array2d high = -low;
  int below_eye = 0;
  for (const Vertex* corner : content.corners) {
    if (p_eye_ && !(corner->p.z() < p_eye_->z())) continue;
    ++below_eye;
    for (const double height : {relief_->least(), relief_->greatest()}) {
      Eigen::Vector2d foot = corner->p.head<2>();
      if (p_eye_) {
        const double share =
            (p_eye_->z() - std::min(height, p_eye_->z())) / (p_eye_->z() - corner->p.z());
        foot = p_eye_->head<2>() + share * (foot - p_eye_->head<2>());
      }
      low = low.min(relief_->inCells(foot).array());
      high = high.max(relief_->inCells(foot).array());
    }
  }
  if (below_eye == 0) return std::nullopt;
  if (below_eye < 3) return Cells{{0, 0}, end.cast<int>()};
  if (!((low <= end).all() && (high >= 0).all())) return std::nullopt;
  return Cells{low.max(0).cast<int>(), high.min(end).cast<int>()};
}

void ReliefPlacer::layOn(int column, int row, const Content& content, LaidMesh& out) const {
  constexpr std::array<std::array<int, 2>, 4> kNodes = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  Polygon cell;
  cell.count = kNodes.size();
  for (std::size_t i = 0; i < kNodes.size(); ++i) {
    const Eigen::Vector3d p = relief_->place(column + kNodes[i][0], row + kNodes[i][1]);
    cell.corners[i].p = p;
    const Eigen::Vector3d shares = content.shares * p.homogeneous();
    cell.corners[i].inside << (shares.array().abs() < kOnSide).select(0, shares), 0;
  }
  const auto each = [&cell](const auto& holds) {
    return std::all_of(cell.corners.begin(), cell.corners.begin() + 4, holds);
  };
  for (Eigen::Index side = 0; side < 3; ++side) {
    if (each([side](const Corner& corner) { return corner.inside[side] <= 0; })) return;
  }
  for (std::size_t i = 0; i < kNodes.size(); ++i) {
    cell.corners[i].inside[3] = clearance(column + kNodes[i][0], row + kNodes[i][1]);
  }
  const auto& c = cell.corners;
  const bool is_first = !isStretched(c[0], c[1], c[2]), is_second = !isStretched(c[0], c[2], c[3]);
  const bool is_whole =
      each([](const Corner& corner) { return (corner.inside.array() >= 0).all(); });
  if (is_whole && is_first && is_second) return add(cell, content, out);
  for (const std::size_t second : {1, 2}) {
    if (!(second == 1 ? is_first : is_second)) continue;
    Polygon half{{c[0], c[second], c[second + 1]}, 3};
    for (Eigen::Index side = 0; side < 4; ++side) cut(side, half);
    add(half, content, out);
  }
}

/// Returns true if content on a triangle of the relief would be drawn out much, compared with the
/// plane, or if the viewer sees the triangle's back.
bool ReliefPlacer::isStretched(const Corner& a, const Corner& b, const Corner& c) const {
  const Eigen::Vector3d normal = (b.p - a.p).cross(c.p - a.p);
  const Eigen::Vector3d way =
      p_eye_ ? Eigen::Vector3d(a.p - *p_eye_) : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  return !(way.z() < 0) || kMostStretch * normal.dot(way) >= way.z() * normal.norm();
}

/// Cuts a polygon to the part that is not outside of a side. Neighbors share the new corners to the
/// last bit: they are reckoned from the same end of an edge.
void ReliefPlacer::cut(Eigen::Index side, Polygon& polygon) {
  const auto end = polygon.corners.begin() + static_cast<std::ptrdiff_t>(polygon.count);
  const auto isOutside = [side](const Corner& corner) { return corner.inside[side] < 0; };
  if (std::none_of(polygon.corners.begin(), end, isOutside)) return;
  Polygon kept;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const Corner* a = &polygon.corners[i];
    const Corner* b = &polygon.corners[(i + 1) % polygon.count];
    if (a->inside[side] >= 0) kept.corners[kept.count++] = *a;
    if (a->inside[side] * b->inside[side] >= 0) continue;
    if (isBefore(b->p, a->p)) std::swap(a, b);
    const double share = a->inside[side] / (a->inside[side] - b->inside[side]);
    Corner& corner = kept.corners[kept.count++];
    corner = {a->p + share * (b->p - a->p), a->inside + share * (b->inside - a->inside)};
    corner.inside[side] = 0;
  }
  polygon = kept;
}

void ReliefPlacer::add(const Polygon& polygon, const Content& content, LaidMesh& out) const {
  const auto first = static_cast<std::uint32_t>(out.mesh.points.size());
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const Corner& corner = polygon.corners[i];
    const Eigen::Vector3d positive = corner.inside.head<3>().cwiseMax(0);
    const Eigen::Vector3d weights = positive / positive.sum();
    double height = 0;
    Eigen::Vector4f color = Eigen::Vector4f::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      const double weight = weights[static_cast<Eigen::Index>(k)];
      height += weight * content.corners[k]->p.z();
      color += static_cast<float>(weight) * content.corners[k]->color;
    }
    out.mesh.points.push_back(T_world_surface_ * corner.p);
    out.mesh.colors.push_back(asBytes(color));
    out.heights.push_back(height);
  }
  for (std::uint32_t i = 2; i < polygon.count; ++i) {
    out.mesh.triangles.push_back({first, first + i - 1, first + i});
  }
}

}  // namespace afterglow::render
