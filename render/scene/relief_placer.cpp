#include "render/scene/relief_placer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>

namespace afterglow::render {
namespace {

constexpr std::uint32_t kNoVertex = ~std::uint32_t{0};
constexpr std::size_t kFewSlots = 1024;  // enough for most meshes
constexpr int kMaxReliefSplits = 80;  // of anything that is not absurd
/// Content is laid as long as it is lower than this share of the eye's height over the plane.
constexpr double kHighest = 0.999;
/// Light that is stopped this near to where it is to land, meters, is not stopped: noise.
constexpr double kTouch = 0.01;
constexpr double kFinest = 1.0 / 8;  // of a cell
/// The smallest triangles whose corners land this many cells apart reach over something hidden.
constexpr double kFarApart = 2;

}  // namespace

void ReliefPlacer::begin(const Layer& layer, const Eigen::Vector3d& p_light) {
  if (!layer.surface || !layer.surface->relief || layer.placement == Placement::Direct) {
    throw std::logic_error("layer " + layer.name + " is not placed on a relief");
  }
  relief_ = layer.surface->relief.get();
  T_world_surface_ = layer.surface->T_world_surface.matrix();
  p_light_ = T_world_surface_.inverse() * p_light;
  has_eye_ = layer.placement == Placement::Viewer;
  p_eye_ = T_world_surface_.inverse() * layer.p_viewer;
}

Eigen::Vector2d ReliefPlacer::footOf(const Eigen::Vector3d& p, double height) const {
  if (!has_eye_) return p.head<2>();
  const double share = (p_eye_.z() - height) / (p_eye_.z() - p.z());
  return p_eye_.head<2>() + (p.head<2>() - p_eye_.head<2>()) * share;
}

std::optional<Eigen::Vector3d> ReliefPlacer::landing(const Eigen::Vector3d& p) const {
  if (has_eye_) {
    return p.z() < p_eye_.z() ? relief_->firstHit(p_eye_, p - p_eye_) : std::nullopt;
  }
  const auto height = relief_->height(p.head<2>());
  if (!height) return std::nullopt;
  return Eigen::Vector3d(p.x(), p.y(), *height);
}

std::optional<Eigen::Vector3d> ReliefPlacer::spotOf(const Eigen::Vector3d& p) const {
  const auto spot = landing(p);
  if (!spot) return std::nullopt;
  const auto stopped = relief_->firstHit(p_light_, *spot - p_light_);
  const bool is_reached = !stopped || (*stopped - *spot).norm() < kTouch;
  return is_reached ? spot : std::nullopt;
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
  forgetEdges();
  if (relief_->range().isEmpty()) return;
  out_ = &out;
  const Eigen::Isometry3d T_surface_world = T_world_surface_.inverse();
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    addVertex(T_surface_world * mesh.points[i], asFloats(mesh.colors[i]));
  }
  for (const Triangle& triangle : mesh.triangles) layBelowEye(triangle);
}

std::uint32_t ReliefPlacer::addVertex(const Eigen::Vector3d& p, const Eigen::Vector4f& color) {
  vertices_.push_back({p, color, footOf(p, relief_->range().least), spotOf(p), kNoVertex});
  return static_cast<std::uint32_t>(vertices_.size() - 1);
}

std::uint32_t ReliefPlacer::addBetween(std::uint32_t a, std::uint32_t b, double share) {
  const Vertex &from = vertices_[a], &to = vertices_[b];
  const Eigen::Vector3d p = from.p * (1 - share) + to.p * share;
  const auto s = static_cast<float>(share);
  const Eigen::Vector4f color = from.color * (1 - s) + to.color * s;
  return addVertex(p, color);
}

/// Content as high as the eye or higher has no place below the eye.
void ReliefPlacer::layBelowEye(const Triangle& triangle) {
  const double highest = kHighest * p_eye_.z();
  const auto room = [&](std::uint32_t i) { return highest - vertices_[i].p.z(); };
  const auto is_below = [&](std::uint32_t i) { return !has_eye_ || room(i) >= 0; };
  if (std::all_of(triangle.begin(), triangle.end(), is_below)) return split(triangle, 0);
  std::array<std::uint32_t, 4> kept{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
    if (is_below(a)) kept[count++] = a;
    if (is_below(a) == is_below(b)) continue;
    // From the lower end, whichever way round the triangle has it: neighbors agree.
    const std::uint32_t low = is_below(a) ? a : b, high = is_below(a) ? b : a;
    kept[count++] = addBetween(low, high, room(low) / (room(low) - room(high)));
  }
  for (std::size_t i = 2; i < count; ++i) split({kept[0], kept[i - 1], kept[i]}, 0);
}

ReliefPlacer::Edge& ReliefPlacer::edge(std::uint32_t a, std::uint32_t b) {
  const std::uint64_t key = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  if (2 * edge_count_ >= slots_.size()) doubleSlots();
  Slot& slot = slotOf(key);
  if (slot.key == kFree) {
    slot = {key, {0, false, kNoVertex}};
    ++edge_count_;
    judge(slot.edge, a, b);
  }
  return slot.edge;
}

void ReliefPlacer::forgetEdges() {
  slots_.assign(kFewSlots, {kFree, {}});
  edge_count_ = 0;
}

/// Its own, or the free one where it belongs.
ReliefPlacer::Slot& ReliefPlacer::slotOf(std::uint64_t key) {
  const std::size_t last = slots_.size() - 1;
  const std::uint64_t mixed = key * 0x9e3779b97f4a7c15;  // Fibonacci hashing: the upper bits count
  for (std::size_t i = (mixed >> 32) & last;; i = (i + 1) & last) {
    if (slots_[i].key == key || slots_[i].key == kFree) return slots_[i];
  }
}

void ReliefPlacer::doubleSlots() {
  std::vector<Slot> old(2 * slots_.size(), {kFree, {}});
  old.swap(slots_);
  for (const Slot& slot : old) {
    if (slot.key != kFree) slotOf(slot.key) = slot;
  }
}

std::uint32_t ReliefPlacer::middle(Edge& edge, std::uint32_t a, std::uint32_t b) {
  if (edge.middle == kNoVertex) edge.middle = addBetween(a, b, 0.5);
  return edge.middle;
}

/// Looks at all that the edge's light can meet.
void ReliefPlacer::judge(Edge& edge, std::uint32_t from, std::uint32_t to) {
  const Vertex a = vertices_[from], b = vertices_[to];
  const Relief::Range& all = relief_->range();
  Eigen::Array2d low = a.foot.array().min(b.foot.array());
  Eigen::Array2d high = a.foot.array().max(b.foot.array());
  const auto include = [&](const Eigen::Vector2d& p) {
    low = low.min(p.array());
    high = high.max(p.array());
  };
  if (has_eye_) {
    for (const Vertex* vertex : {&a, &b}) include(footOf(vertex->p, all.greatest));
  }
  const Relief::Range under = relief_->range(low, high);
  const double any = std::numeric_limits<double>::infinity();
  const double cell = relief_->cell();
  edge.is_empty = under.isEmpty();
  edge.allowed = any;
  if (edge.is_empty) return;
  if (!under.is_complete || a.spot.has_value() != b.spot.has_value()) {
    edge.allowed = cell * kFinest;
    return;
  }
  // What may stand in the light's way, between the ground and the greatest height.
  const double rise = p_light_.z() - all.least;
  const double share = rise > 0 ? std::min(1.0, (all.greatest - all.least) / rise) : 1;
  const std::array<Eigen::Vector2d, 2> corners = {low.matrix(), high.matrix()};
  for (const Eigen::Vector2d& p : corners) include(p + (p_light_.head<2>() - p) * share);
  const Relief::Range around = relief_->range(low, high);
  if (around.greatest - around.least <= kTolerance) return;
  const double length = (a.foot - b.foot).norm();
  if (length > cell) {
    edge.allowed = cell;
  } else if (length > cell * kFinest && a.spot) {
    const auto& spot = vertices_[middle(edge, from, to)].spot;
    const bool follows = spot && (*spot - (*a.spot + *b.spot) / 2).norm() <= kTolerance;
    edge.allowed = follows ? any : cell * kFinest;
  }
}

void ReliefPlacer::split(const Triangle& triangle, int depth) {
  std::size_t longest = 3;
  double length = 0;
  bool is_empty = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
    const Edge& between = edge(a, b);
    is_empty = is_empty && between.is_empty;
    const double own = (vertices_[a].foot - vertices_[b].foot).norm();
    if (own <= std::max(between.allowed, length)) continue;
    length = own;
    longest = i;
  }
  if (is_empty) return;  // the edges' surroundings cover the triangle's
  if (longest == 3 || depth == kMaxReliefSplits) return add(triangle);
  const std::uint32_t from = triangle[longest], to = triangle[(longest + 1) % 3];
  const std::uint32_t other = triangle[(longest + 2) % 3];
  const std::uint32_t between = middle(edge(from, to), from, to);
  split({from, between, other}, depth + 1);
  split({between, to, other}, depth + 1);
}

void ReliefPlacer::add(const Triangle& triangle) {
  for (std::size_t i = 0; i < 3; ++i) {
    const Vertex &a = vertices_[triangle[i]], &b = vertices_[triangle[(i + 1) % 3]];
    if (!a.spot || !b.spot) return;
    const bool is_finest = (a.foot - b.foot).norm() <= kFinest * relief_->cell();
    if (is_finest && (*a.spot - *b.spot).norm() > kFarApart * relief_->cell()) return;
  }
  Triangle indices;
  for (std::size_t i = 0; i < 3; ++i) {
    Vertex& vertex = vertices_[triangle[i]];
    if (vertex.index == kNoVertex) {
      vertex.index = static_cast<std::uint32_t>(out_->mesh.points.size());
      out_->mesh.points.push_back(T_world_surface_ * *vertex.spot);
      out_->mesh.colors.push_back(asBytes(vertex.color));
      out_->heights.push_back(vertex.p.z());
    }
    indices[i] = vertex.index;
  }
  out_->mesh.triangles.push_back(indices);
}

}  // namespace afterglow::render
